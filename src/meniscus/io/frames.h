#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace meniscus::io {

/// Frame numbers from "1-48", "1-100x2" (every second), "5,9,12-20": ascending, each once. Throws InvalidInput for anything
/// else, and for more than a million frames.
std::vector<long> parse_frames(std::string_view text);

/// A frame number and the file that holds it.
struct FrameFile {
  long frame = 0;
  std::string path;
};

/// A file name with a place for the frame number: "skin.####.ply", "skin.%04d.ply", "skin.$F4.ply", "skin.{}.ply".
class FramePattern {
 public:
  /// Nothing when the name has no such place. Throws InvalidInput when it has several, or one in a folder's name.
  static std::optional<FramePattern> parse(const std::string& path);

  /// The name for a frame, its number padded with zeros as the pattern says.
  std::string path(long frame) const;

  /// The files on disk that fit, by frame number. A padded pattern takes only names it would write; an unpadded one ("{}",
  /// "#",
  /// "%d", "$F") any number of zeros. Throws InvalidInput when two files are the same frame ("1" and "01").
  std::vector<FrameFile> existing() const;

 private:
  std::string before_;  ///< with the folder
  std::string after_;
  std::size_t width_ = 0;
};

/// Frame numbers for files given one by one. If their names differ in one number alone, that is the frame and they are
/// sorted; otherwise they are frames 1, 2, … in the order given. Throws InvalidInput for the same frame twice.
std::vector<FrameFile> number_files(const std::vector<std::string>& paths);

}  // namespace meniscus::io
