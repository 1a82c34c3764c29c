#include <meniscus/base/error.h>
#include <meniscus/io/frames.h>
#include <meniscus/io/manifest.h>
#include <meniscus/mesh/components.h>
#include <meniscus/polygonize/mend.h>
#include <meniscus/polygonize/polygonize.h>
#include <meniscus/scene/inherit.h>
#include <meniscus/scene/point_population.h>
#include <meniscus/scene/tie_frames.h>
#include <meniscus/scene/track_job.h>
#include <meniscus/scene/track_state.h>

#include <nlohmann/json.hpp>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <numeric>

namespace meniscus::scene {
namespace {

constexpr std::string_view kRest = "rest";
constexpr double kResolution = 0.25;  // of a voxel
constexpr std::size_t kFolded = 100;  // a mesh with one triangle in so many turned over is done with

/// What tells surfaces apart that no motion carries into one another.
struct Topology {
  std::size_t components = 0;
  std::ptrdiff_t euler = 0;
  bool operator==(const Topology&) const = default;
};

/// Of a closed manifold, which has three edges for every two triangles.
Topology topology_of(const mesh::Mesh& mesh) {
  return {mesh::components(mesh).count,
          static_cast<std::ptrdiff_t>(mesh.positions.size()) - static_cast<std::ptrdiff_t>(mesh.triangles.size() / 2)};
}

/// A checkerboard in space, of two colours.
std::vector<double> checkered(const std::vector<Vec3>& positions, double size) {
  std::vector<double> colors;
  for (const Vec3& p : positions) {
    const Vec3 cell = (p / size).array().floor();
    const bool odd = std::fmod(std::abs(cell.sum()), 2) != 0;
    if (odd)
      colors.insert(colors.end(), {0.75, 0.30, 0.12});
    else
      colors.insert(colors.end(), {0.85, 0.80, 0.68});
  }
  return colors;
}

Attributes first_attributes(const std::vector<Vec3>& positions, const std::optional<double>& checker) {
  std::vector<double> rest;
  for (const Vec3& p : positions) rest.insert(rest.end(), {p.x(), p.y(), p.z()});
  Attributes attributes;
  attributes.set(kRest, 3, std::move(rest));
  if (checker) attributes.set(attribute::kColor, 3, checkered(positions, *checker));
  return attributes;
}

std::vector<std::string> output_names(const std::string& output, const std::vector<long>& frames) {
  const auto pattern = io::FramePattern::parse(output);
  if (!pattern && frames.size() > 1)
    throw InvalidInput("'" + output + "' has no place for the frame number: write, say, track.####.ply");
  std::vector<std::string> names;
  for (const long f : frames) names.push_back(pattern ? pattern->path(f) : output);
  return names;
}

/// The job's state: the tracker of the moment, and the surfaces it moves between.
class TrackJob {
 public:
  TrackJob(const SurfaceSource& source, const TrackJobOptions& options) : source_(source), options_(options) {}

  TrackJobFrame start(long frame, const RunControl& run);
  TrackJobFrame advance(long frame, const RunControl& run);
  void fill(TrackJobFrame& frame) const;
  void write(const TrackJobFrame& frame, const io::WriteOptions& options) const;
  TrackState state() const;
  /// Goes on after `frame`.
  void resume(long frame, TrackState state, const RunControl& run);

 private:
  double time_of(long frame) const { return static_cast<double>(frame) / source_.frames_per_second(); }
  bool sequence() const { return source_.kind() == SurfaceSource::Kind::Particles; }
  polygonize::PolygonizeOptions meshing() const;
  mesh::Mesh lattice_surface(const RunControl& run) const;
  mesh::Mesh new_mesh(const RunControl& run) const;
  void number(Attributes& attributes, std::size_t kept, std::size_t size);
  template <class Tracker>
  motion::StepReport carry(Tracker& tracker, long frame, const RunControl& run);
  void start_points(double time, const RunControl& run);
  TrackJobFrame advance_mesh(long frame, const RunControl& run);
  TrackJobFrame advance_points(long frame, const RunControl& run);
  bool stretched(const RunControl& run) const;
  void mend(TrackJobFrame& out, const RunControl& run);

  /// A mesh says nothing of what is smaller than a fraction of its cells.
  motion::TrackerOptions tracking() const {
    motion::TrackerOptions options = options_.tracker;
    if (!options.velocity.resolution && voxel_ > 0) options.velocity.resolution = kResolution * voxel_;
    return options;
  }

  const SurfaceSource& source_;
  const TrackJobOptions& options_;
  Surface surface_;
  double voxel_ = 0;
  std::int64_t next_id_ = 0;
  std::int64_t steps_ = 0;
  std::optional<motion::MeshTracker> mesh_;
  std::optional<motion::PointTracker> points_;
};

polygonize::PolygonizeOptions TrackJob::meshing() const {
  const Box bounds = surface_.field->bounds();
  if (!bounds.finite() && !bounds.empty()) throw InvalidInput("the surface is unbounded: it cannot be meshed whole");
  return {.voxel = voxel_ > 0 ? voxel_ : 1, .count_components = false};
}

/// What the signs of F on the lattice say; vertices are near the surface only.
mesh::Mesh TrackJob::lattice_surface(const RunControl& run) const {
  auto options = meshing();
  options.projection = 0;
  options.normals = false;
  return polygonize::polygonize(*surface_.field, options, run).mesh;
}

mesh::Mesh TrackJob::new_mesh(const RunControl& run) const {
  return polygonize::polygonize(*surface_.field, meshing(), run).mesh;
}

/// Gives what follows the first `kept` elements ids of their own.
void TrackJob::number(Attributes& attributes, std::size_t kept, std::size_t size) {
  const auto old = attributes.integers(attribute::kId);
  std::vector<std::int64_t> ids(old.begin(), old.end());
  ids.resize(size);
  std::iota(ids.begin() + static_cast<std::ptrdiff_t>(kept), ids.end(), next_id_);
  next_id_ += static_cast<std::int64_t>(size - kept);
  attributes.set_integers(attribute::kId, 1, std::move(ids));
}

void TrackJob::fill(TrackJobFrame& frame) const {
  if (points_) {
    frame.vertices = points_->cloud().size();
    frame.bounds = points::bounds(points_->cloud());
    return;
  }
  frame.vertices = mesh_->mesh().positions.size();
  frame.triangles = mesh_->mesh().triangles.size();
  frame.bounds = mesh::bounds(mesh_->mesh());
}

TrackJobFrame TrackJob::start(long frame, const RunControl& run) {
  surface_ = source_.open(frame, run);
  voxel_ = options_.voxel.value_or(surface_.voxel);
  TrackJobFrame out;
  out.remeshed = "first";
  if (options_.points) {
    start_points(time_of(frame), run);
    out.step = points_->measures();
    return out;
  }
  mesh::Mesh mesh = new_mesh(run);
  motion::fair(*surface_.field, mesh, options_.first_fairing, run);
  mesh.attributes = first_attributes(mesh.positions, options_.checker);
  number(mesh.attributes, 0, mesh.positions.size());
  mesh_.emplace(std::move(mesh), *surface_.field, time_of(frame), tracking(), run);
  out.step = mesh_->measures();
  return out;
}

void TrackJob::start_points(double time, const RunControl& run) {
  const PointPopulation population(*surface_.field, voxel_ > 0 ? voxel_ : 1);
  points::Cloud cloud = population.first(run);
  cloud.attributes = first_attributes(cloud.positions, options_.checker);
  number(cloud.attributes, 0, cloud.size());
  points_.emplace(std::move(cloud), *surface_.field, time, voxel_ > 0 ? voxel_ : 1, tracking(), run);
}

template <class Tracker>
motion::StepReport TrackJob::carry(Tracker& tracker, long frame, const RunControl& run) {
  if (sequence()) surface_ = source_.open(frame, run);
  const auto pose = [&](double t) -> const field::Field& {
    if (!sequence()) surface_.field->set_time(t);
    return *surface_.field;
  };
  return tracker.advance(pose, time_of(frame), run);
}

TrackJobFrame TrackJob::advance(long frame, const RunControl& run) {
  ++steps_;
  return points_ ? advance_points(frame, run) : advance_mesh(frame, run);
}

TrackJobFrame TrackJob::advance_mesh(long frame, const RunControl& run) {
  TrackJobFrame out;
  out.step = carry(*mesh_, frame, run);
  out.kept = mesh_->mesh().positions.size();
  if (topology_of(mesh_->mesh()) != topology_of(lattice_surface(run)))
    out.remeshed = "topology";
  else if (out.step.lost > 0)
    out.remeshed = "lost";
  else if (out.step.flips * kFolded > mesh_->mesh().triangles.size())
    out.remeshed = "folded";
  else if (stretched(run))
    out.remeshed = "stretched";
  if (!out.remeshed.empty()) mend(out, run);
  return out;
}

/// Whether some triangle's middle is farther from the surface than a mesh of this voxel may be.
bool TrackJob::stretched(const RunControl& run) const {
  const mesh::Mesh& mesh = mesh_->mesh();
  std::vector<Vec3> middles;
  for (const Triangle& t : mesh.triangles) {
    Vec3 sum = Vec3::Zero();
    for (const std::int32_t v : t) sum += mesh.positions[static_cast<std::size_t>(v)];
    middles.emplace_back(sum / 3);
  }
  const field::JetBatch jets = field::evaluate(*surface_.field, middles, field::Order::Gradient, run);
  for (std::size_t f = 0; f < middles.size(); ++f)
    if (std::abs(jets.value(f)) > polygonize::kMendDistance * voxel_ * jets.gradient(f).norm()) return true;
  return false;
}

void TrackJob::mend(TrackJobFrame& out, const RunControl& run) {
  const mesh::Mesh& old = mesh_->mesh();
  polygonize::Mended mended = polygonize::mend(old, mesh_->lost(), new_mesh(run), voxel_, run);
  const std::size_t kept = mended.kept_vertices.size();
  mesh::Mesh& mesh = mended.mesh;
  motion::fair(*surface_.field, mesh, options_.first_fairing, run, kept);
  mesh.attributes = old.positions.empty() ? first_attributes(mesh.positions, options_.checker)
                                          : inherited(old, mended.kept_vertices, mesh.positions);
  number(mesh.attributes, kept, mesh.positions.size());
  out.kept = kept;
  out.regions = std::move(mended.regions);
  mesh_->replace(std::move(mesh), mended.kept_vertices, mended.kept_triangles, *surface_.field, run);
  const motion::StepReport step = out.step;
  out.step = mesh_->measures();
  out.step.lost = step.lost;  // what the step did stays in the report; the measures are the new mesh's
  out.step.seconds_velocity = step.seconds_velocity;
  out.step.seconds_fairing = step.seconds_fairing;
}

TrackJobFrame TrackJob::advance_points(long frame, const RunControl& run) {
  TrackJobFrame out;
  out.step = carry(*points_, frame, run);
  const PointPopulation population(*surface_.field, voxel_);
  points::Cloud cloud = points_->cloud();
  const bool now = options_.redistribution > 0 && steps_ % options_.redistribution == 0;
  out.kept = now ? population.redistribute(cloud, run) : cloud.size();
  population.cover(cloud, lattice_surface(run).positions, run);
  out.born = cloud.size() - out.kept;
  if (now) out.remeshed = "redistributed";
  if (!now && out.born == 0) return out;
  if (points_->cloud().empty()) cloud.attributes = first_attributes(cloud.positions, options_.checker);
  number(cloud.attributes, out.kept, cloud.size());
  points_.emplace(std::move(cloud), *surface_.field, time_of(frame), voxel_, tracking(), run);
  const motion::StepReport step = out.step;
  out.step = points_->measures();
  out.step.lost = step.lost;
  out.step.seconds_velocity = step.seconds_velocity;
  return out;
}

void TrackJob::write(const TrackJobFrame& frame, const io::WriteOptions& options) const {
  if (points_)
    io::write_cloud(frame.path, points_->cloud(), options);
  else
    io::write_mesh(frame.path, mesh_->mesh(), options);
}

TrackState TrackJob::state() const {
  if (points_) return {{points_->cloud().positions, {}, points_->cloud().attributes}, {}, next_id_, steps_};
  return {mesh_->mesh(), mesh_->references(), next_id_, steps_};
}

void TrackJob::resume(long frame, TrackState state, const RunControl& run) {
  surface_ = source_.open(frame, run);
  voxel_ = options_.voxel.value_or(surface_.voxel);
  next_id_ = state.next_id;
  steps_ = state.steps;
  if (options_.points) {
    points::Cloud cloud{std::move(state.mesh.positions), std::move(state.mesh.attributes)};
    points_.emplace(std::move(cloud), *surface_.field, time_of(frame), voxel_ > 0 ? voxel_ : 1, tracking(), run);
    return;
  }
  mesh_.emplace(std::move(state.mesh), *surface_.field, time_of(frame), tracking(), run);
  mesh_->set_references(std::move(state.references));
}

/// Everything that determines the frames, as text: what a manifest compares.
std::string settings_text(const SurfaceSource& source, const TrackJobOptions& o, const std::vector<long>& frames) {
  const auto number = [](const std::optional<double>& v) { return v ? nlohmann::json(*v) : nlohmann::json(); };
  const nlohmann::json j{{"source", source.settings()},
                         {"velocity", static_cast<int>(o.tracker.velocity.kind)},
                         {"integrator", static_cast<int>(o.tracker.integrator)},
                         {"fairing", o.tracker.fairing},
                         {"points", o.points},
                         {"voxel", number(o.voxel)},
                         {"first_fairing", o.first_fairing},
                         {"redistribution", o.redistribution},
                         {"checker", number(o.checker)},
                         {"output", std::filesystem::path(o.output).filename().string()},
                         {"first", frames.front()}};
  return j.dump();
}

/// What is on disk: the manifest, the state of the last frame, and in the end the collection. Nothing but the frame for a
/// single one without a pattern.
class Progress {
 public:
  Progress(const SurfaceSource& source, const TrackJobOptions& options, const std::vector<long>& frames)
      : frames_(frames),
        output_(options.output),
        fps_(source.frames_per_second()),
        sequence_(io::FramePattern::parse(options.output).has_value()),
        manifest_(io::manifest_path(options.output), settings_text(source, options, frames)),
        write_(options.write) {
    write_.comments.clear();  // the command line differs between a run and its --resume; the frames must not
    if (!options.resume || !sequence_) return;
    write_.overwrite = true;
    if (manifest_.resume() == 0) return;
    while (finished_ < frames.size() && manifest_.has(frames[finished_])) ++finished_;
    while (finished_ > 0 && !std::filesystem::exists(state_path(frames[finished_ - 1]))) --finished_;
  }

  std::size_t finished() const { return finished_; }
  const io::WriteOptions& write_options() const { return write_; }
  std::string state_path(long frame) const { return sequence_stem(output_) + ".state." + std::to_string(frame) + ".cbor"; }

  void add(std::size_t i, const std::string& path, const TrackState& state) {
    if (!sequence_) return;
    save_track_state(state_path(frames_[i]), state, replacing());
    manifest_.add(frames_[i], path, write_);
    std::error_code ignored;
    if (i > 0) std::filesystem::remove(state_path(frames_[i - 1]), ignored);
  }

  void tie() const {
    if (sequence_) tie_frames(output_, frames_, fps_, write_);
  }

 private:
  io::WriteOptions replacing() const {
    io::WriteOptions options = write_;
    options.overwrite = true;
    return options;
  }

  const std::vector<long>& frames_;
  std::string output_;
  double fps_;
  bool sequence_;
  io::Manifest manifest_;
  io::WriteOptions write_;
  std::size_t finished_ = 0;
};

}  // namespace

std::vector<TrackJobFrame> run_track_job(const SurfaceSource& source, const TrackJobOptions& options,
                                         const std::function<void(const TrackJobFrame&)>& on_frame, RunControl run) {
  if (options.voxel && !(std::isfinite(*options.voxel) && *options.voxel > 0))
    throw InvalidInput("the voxel must be above zero");
  if (options.checker && !(std::isfinite(*options.checker) && *options.checker > 0))
    throw InvalidInput("the squares of a checkerboard must be above zero");
  if (source.kind() == SurfaceSource::Kind::Particles && options.tracker.integrator == motion::Integrator::RungeKutta4)
    throw InvalidInput("a particle sequence has no frames between frames: use Euler's or Heun's method");
  const std::vector<long> frames = source.frames().empty() ? source.all_frames() : source.frames();
  if (frames.empty()) throw InvalidInput("the input has no frames to track over");
  const std::vector<std::string> names = output_names(options.output, frames);

  TrackJob job(source, options);
  Progress progress(source, options, frames);
  std::vector<TrackJobFrame> report;
  const std::size_t first = progress.finished();
  for (std::size_t i = 0; i < first; ++i) {
    TrackJobFrame kept;
    kept.frame = frames[i];
    kept.path = names[i];
    kept.finished_before = true;
    report.push_back(kept);
    if (on_frame) on_frame(kept);
  }
  if (first > 0) job.resume(frames[first - 1], load_track_state(progress.state_path(frames[first - 1])), run);
  for (std::size_t i = first; i < frames.size(); ++i) {
    const double count = static_cast<double>(frames.size());
    const RunControl part = run.part(static_cast<double>(i) / count, static_cast<double>(i + 1) / count);
    part.check();
    part.progress(0, "frame " + std::to_string(frames[i]));
    const auto started = std::chrono::steady_clock::now();
    TrackJobFrame out = i == 0 ? job.start(frames[i], part) : job.advance(frames[i], part);
    out.frame = frames[i];
    out.path = names[i];
    job.fill(out);
    job.write(out, progress.write_options());
    progress.add(i, names[i], job.state());
    out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    part.progress(1, "frame " + std::to_string(frames[i]));
    report.push_back(out);
    if (on_frame) on_frame(report.back());
  }
  progress.tie();
  return report;
}

}  // namespace meniscus::scene
