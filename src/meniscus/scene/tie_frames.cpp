#include <meniscus/base/error.h>
#include <meniscus/io/frames.h>
#include <meniscus/io/manifest.h>
#include <meniscus/io/usd.h>
#include <meniscus/scene/tie_frames.h>

#include <filesystem>

namespace meniscus::scene {

std::string sequence_stem(const std::string& pattern) {
  const std::string manifest = io::manifest_path(pattern);
  return manifest.substr(0, manifest.rfind(".manifest.json"));
}

void tie_frames(const std::string& pattern, const std::vector<long>& frames, double fps, io::WriteOptions options) {
  const std::string format = io::format_of_path(pattern);
  if (format != "vtp" && format != "usda") return;
  const auto names = io::FramePattern::parse(pattern);
  if (!names) throw InvalidInput("'" + pattern + "' has no place for the frame number: write, say, skin.####.vtp");
  std::vector<io::SequenceFile> list;
  for (const long f : frames)
    list.push_back({format == "usda" ? static_cast<double>(f) : static_cast<double>(f) / fps,
                    std::filesystem::path(names->path(f)).filename().string()});
  options.overwrite = true;
  if (format == "vtp")
    io::write_pvd(sequence_stem(pattern) + ".pvd", list, options);
  else
    io::write_usd_sequence(sequence_stem(pattern) + ".usda", list, options);
}

}  // namespace meniscus::scene
