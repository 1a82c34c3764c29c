#pragma once

#include <meniscus/io/geometry.h>

#include <nlohmann/json.hpp>

#include <map>
#include <string>
#include <string_view>

namespace meniscus::io {

/// A 128-bit fingerprint as 32 hexadecimal digits. Tells files and settings apart; no protection against intent.
std::string fingerprint(std::string_view bytes);

/// The fingerprint of a file's content; empty when the file cannot be read.
std::string fingerprint_of_file(const std::string& path);

/// What a sequence writer has finished, for `--resume`: the fingerprint of the settings that made it and of every finished
/// frame. Written after the frame itself, whole or not at all, so a frame it names is complete; frames it does not name are
/// made again.
class Manifest {
 public:
  /// `path` of the manifest (see manifest_path); `settings`: any text that determines the frames.
  Manifest(std::string path, std::string_view settings);

  /// Takes over the frames of an earlier run of the same settings whose files (beside the manifest) still have their
  /// fingerprints; returns how many. No manifest, a broken one and other settings give none.
  std::size_t resume();

  /// Whether the frame is finished.
  bool has(long frame) const { return frames_.contains(frame); }

  /// Notes a finished frame (its file lies in the manifest's folder) and writes the manifest. `about`: an object whose
  /// members stand beside the frame's, for people and other programs.
  /// Throws IoError of kind Write when it cannot, or of kind Read when the frame's file is not there.
  void add(long frame, const std::string& file, const WriteOptions& options = {}, nlohmann::json about = {});

 private:
  struct Entry {
    std::string file;  ///< name without folder
    std::string hash;
    nlohmann::json about;
  };
  void write(const WriteOptions& options) const;

  std::string path_;
  std::string settings_;
  std::map<long, Entry> frames_;
};

/// Where the manifest of a sequence lies: "out/skin.####.ply" -> "out/skin.manifest.json".
std::string manifest_path(const std::string& pattern);

}  // namespace meniscus::io
