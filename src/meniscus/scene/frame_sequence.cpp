#include <meniscus/base/error.h>
#include <meniscus/io/frames.h>
#include <meniscus/io/manifest.h>
#include <meniscus/scene/frame_sequence.h>
#include <meniscus/scene/tie_frames.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

namespace meniscus::scene {
namespace {

namespace fs = std::filesystem;

/// A file for each frame.
class Names {
 public:
  Names(const std::string& name, std::size_t frames) : name_(name), pattern_(io::FramePattern::parse(name)) {
    if (!pattern_ && frames > 1)
      throw InvalidInput("'" + name + "' has no place for the frame number: write, say, frame.####" +
                         fs::path(name).extension().string());
  }
  bool sequence() const { return pattern_.has_value(); }
  std::string of(long frame) const { return pattern_ ? pattern_->path(frame) : name_; }

 private:
  std::string name_;
  std::optional<io::FramePattern> pattern_;
};

/// What a maker keeps beside the frames, one frame's worth.
class SavedState {
 public:
  SavedState(const FrameMaker& maker, std::string stem) : endings_(maker.state_endings()), stem_(std::move(stem)) {}

  std::string stem(long frame) const { return stem_ + ".state." + std::to_string(frame); }
  bool exists(long frame) const {
    return std::all_of(endings_.begin(), endings_.end(), [&](const auto& e) { return fs::exists(stem(frame) + e); });
  }
  void remove(long frame) const {
    std::error_code ignored;
    for (const std::string& e : endings_) fs::remove(stem(frame) + e, ignored);
  }

 private:
  std::vector<std::string> endings_;
  std::string stem_;
};

/// Takes over what an earlier run has finished; how many frames.
std::size_t resumed(FrameMaker& maker, const std::vector<long>& frames, io::Manifest& manifest, const SavedState& saved,
                    const RunControl& run) {
  if (manifest.resume() == 0) return 0;
  std::size_t first = 0;
  while (first < frames.size() && manifest.has(frames[first])) ++first;
  while (first > 0 && !saved.exists(frames[first - 1])) --first;
  if (first > 0) maker.load(saved.stem(frames[first - 1]), first - 1, run);
  for (std::size_t i = 0; i + 1 < first; ++i) saved.remove(frames[i]);  // a run killed after its manifest leaves one
  return first;
}

}  // namespace

nlohmann::json to_json(const MeshChange& change) {
  nlohmann::json boxes = nlohmann::json::array();
  for (const Box& b : change.regions) {
    const auto corner = [](const Vec3& p) { return nlohmann::json::array({p.x(), p.y(), p.z()}); };
    boxes.push_back(nlohmann::json::array({corner(b.min), corner(b.max)}));
  }
  return {{"remeshed", change.reason}, {"regions", std::move(boxes)}, {"carried", change.carried}};
}

void make_frames(FrameMaker& maker, const std::vector<long>& frames, const SequenceOutput& output,
                 const std::string& settings, const std::function<void(const FrameRecord&)>& on_frame,
                 const RunControl& run) {
  if (!(output.fps > 0)) throw InvalidInput("frames per second must be positive");
  if (frames.empty()) throw InvalidInput("there are no frames to make");
  const Names names(output.meshes, frames.size());
  std::optional<Names> grids;
  if (output.grids) grids.emplace(*output.grids, frames.size());
  io::WriteOptions write = output.write;
  write.comments.clear();  // the command line differs between a run and its --resume; the frames must not
  write.overwrite = output.write.overwrite || (output.resume && names.sequence());
  io::WriteOptions replace = write;
  replace.overwrite = true;

  // Of the output only the name counts: a folder may be moved between runs.
  io::Manifest manifest(io::manifest_path(output.meshes), settings + " " + fs::path(output.meshes).filename().string());
  const SavedState saved(maker, sequence_stem(output.meshes));
  const bool resume = output.resume && names.sequence();
  const std::size_t first = resume ? resumed(maker, frames, manifest, saved, run) : 0;
  for (std::size_t i = 0; i < first && on_frame; ++i)
    on_frame({.frame = frames[i], .path = names.of(frames[i]), .kept = true});

  for (std::size_t i = first; i < frames.size(); ++i) {
    const double count = static_cast<double>(frames.size());
    const RunControl part = run.part(static_cast<double>(i) / count, static_cast<double>(i + 1) / count);
    part.check();
    part.progress(0, "frame " + std::to_string(frames[i]));
    const auto started = std::chrono::steady_clock::now();
    FrameRecord record{.frame = frames[i], .path = names.of(frames[i])};
    if (grids) record.grid_path = grids->of(frames[i]);
    maker.make(i, record, write, part);
    if (names.sequence()) {
      maker.save(saved.stem(frames[i]), replace);
      manifest.add(frames[i], record.path, write, record.change ? to_json(*record.change) : nlohmann::json());
      if (i > 0) saved.remove(frames[i - 1]);
    }
    record.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    part.progress(1, "frame " + std::to_string(frames[i]));
    if (on_frame) on_frame(record);
  }
  if (names.sequence()) tie_frames(output.meshes, frames, output.fps, write);
}

}  // namespace meniscus::scene
