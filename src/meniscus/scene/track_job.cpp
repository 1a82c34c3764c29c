#include <meniscus/base/error.h>
#include <meniscus/io/manifest.h>
#include <meniscus/scene/track_job.h>
#include <meniscus/scene/write_band.h>

#include <nlohmann/json.hpp>

#include <filesystem>

namespace meniscus::scene {
namespace {

/// A tracked surface as frames.
class TrackedFrames final : public FrameMaker {
 public:
  TrackedFrames(TrackedSurface& surface, const std::vector<long>& frames, bool velocity_grids)
      : surface_(surface), frames_(frames), velocity_grids_(velocity_grids) {}

  void make(std::size_t index, FrameRecord& record, const io::WriteOptions& write, const RunControl& run) override {
    last = surface_.go_to(frames_[index], run);
    record.change = last.change;
    if (surface_.points()) {
      record.vertices = surface_.cloud().size();
      record.bounds = points::bounds(surface_.cloud());
      io::write_cloud(record.path, surface_.cloud(), write);
    } else {
      record.vertices = surface_.mesh().positions.size();
      record.triangles = surface_.mesh().triangles.size();
      record.bounds = mesh::bounds(surface_.mesh());
      io::write_mesh(record.path, surface_.mesh(), write);
    }
    if (!record.grid_path) return;
    const auto at = [&](std::span<const Vec3> x) { return surface_.velocities(x); };
    const VelocityAt velocity(at);
    write_band(*record.grid_path, surface_.band(run), velocity_grids_ ? &velocity : nullptr, write);
  }
  std::vector<std::string> state_endings() const override { return {".cbor"}; }
  void save(const std::string& stem, const io::WriteOptions& write) override {
    save_track_state(stem + ".cbor", surface_.state(), write);
  }
  void load(const std::string& stem, std::size_t index, const RunControl& run) override {
    surface_.resume(frames_[index], load_track_state(stem + ".cbor"), run);
  }

  TrackStep last;

 private:
  TrackedSurface& surface_;
  const std::vector<long>& frames_;
  bool velocity_grids_;
};

/// Everything that determines the frames, as text: what a manifest compares.
std::string settings_text(const SurfaceSource& source, const TrackJobOptions& options, const std::vector<long>& frames) {
  const auto number = [](const std::optional<double>& v) { return v ? nlohmann::json(*v) : nlohmann::json(); };
  const TrackOptions& o = options.track;
  const nlohmann::json j{{"source", source.settings()},
                         {"velocity", static_cast<int>(o.tracker.velocity.kind)},
                         {"integrator", static_cast<int>(o.tracker.integrator)},
                         {"fairing", o.tracker.fairing},
                         {"points", o.points},
                         {"voxel", number(o.voxel)},
                         {"first_fairing", o.first_fairing},
                         {"redistribution", o.redistribution},
                         {"checker", number(o.checker)},
                         {"start", options.start ? io::fingerprint_of_file(*options.start) : ""},
                         {"first", frames.front()}};
  return j.dump();
}

}  // namespace

void run_track_job(const SurfaceSource& source, const TrackJobOptions& options,
                   const std::function<void(const TrackJobFrame&)>& on_frame, RunControl run) {
  const std::vector<long> frames = source.frames().empty() ? source.all_frames() : source.frames();
  if (frames.empty()) throw InvalidInput("the input has no frames to track over");
  TrackOptions track = options.track;
  if (options.start) track.start = io::read_geometry(*options.start);
  TrackedSurface surface(source, std::move(track));
  TrackedFrames maker(surface, frames, options.output.velocity_grids);
  SequenceOutput output = options.output;
  output.fps = source.frames_per_second();
  make_frames(
      maker, frames, output, settings_text(source, options, frames),
      [&](const FrameRecord& record) {
        if (on_frame) on_frame({record, record.kept ? motion::StepReport{} : maker.last.step, maker.last.born});
      },
      run);
}

}  // namespace meniscus::scene
