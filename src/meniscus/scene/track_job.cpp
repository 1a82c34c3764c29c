#include <meniscus/base/error.h>
#include <meniscus/io/frames.h>
#include <meniscus/points/neighbours.h>
#include <meniscus/polygonize/polygonize.h>
#include <meniscus/scene/track_job.h>

#include <chrono>
#include <cmath>
#include <numeric>

namespace meniscus::scene {
namespace {

constexpr std::string_view kRest = "rest";
constexpr std::size_t kFolded = 100;  // a mesh with one triangle in so many turned over is done with

/// What the signs of F on a lattice say about the surface's topology.
struct Topology {
  std::size_t components = 0;
  std::ptrdiff_t euler = 0;
  bool operator==(const Topology&) const = default;
};

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
  void write(const TrackJobFrame& frame) const;

 private:
  double time_of(long frame) const { return static_cast<double>(frame) / source_.frames_per_second(); }
  bool sequence() const { return source_.kind() == SurfaceSource::Kind::Particles; }
  polygonize::PolygonizeOptions meshing() const;
  Topology topology(const RunControl& run) const;
  motion::StepReport carry(long frame, const RunControl& run);
  mesh::Mesh new_mesh(const RunControl& run);
  void begin_tracking(mesh::Mesh mesh, double time, const RunControl& run);
  void inherit(mesh::Mesh& mesh, const std::vector<Vec3>& old, const Attributes& attributes) const;

  const SurfaceSource& source_;
  const TrackJobOptions& options_;
  Surface surface_;
  double voxel_ = 0;
  Topology topology_;
  std::int64_t next_id_ = 0;
  std::optional<motion::MeshTracker> mesh_;
  std::optional<motion::PointTracker> points_;
};

polygonize::PolygonizeOptions TrackJob::meshing() const {
  const Box bounds = surface_.field->bounds();
  if (!bounds.finite() && !bounds.empty()) throw InvalidInput("the surface is unbounded: it cannot be meshed whole");
  return {.voxel = voxel_ > 0 ? voxel_ : 1};
}

Topology TrackJob::topology(const RunControl& run) const {
  auto options = meshing();
  options.projection = 0;
  options.normals = false;
  const auto signs = polygonize::polygonize(*surface_.field, options, run);
  // Closed and manifold: three edges for every two triangles.
  return {signs.report.components, static_cast<std::ptrdiff_t>(signs.mesh.positions.size()) -
                                       static_cast<std::ptrdiff_t>(signs.mesh.triangles.size() / 2)};
}

mesh::Mesh TrackJob::new_mesh(const RunControl& run) {
  if (!(voxel_ > 0)) voxel_ = options_.voxel.value_or(surface_.voxel);
  auto meshing_options = meshing();
  meshing_options.count_components = false;
  mesh::Mesh mesh = polygonize::polygonize(*surface_.field, meshing_options, run).mesh;
  motion::fair(*surface_.field, mesh, options_.first_fairing, run);
  std::vector<std::int64_t> ids(mesh.positions.size());
  std::iota(ids.begin(), ids.end(), next_id_);
  next_id_ += static_cast<std::int64_t>(ids.size());
  mesh.attributes.set_integers(attribute::kId, 1, std::move(ids));
  return mesh;
}

void TrackJob::inherit(mesh::Mesh& mesh, const std::vector<Vec3>& old, const Attributes& attributes) const {
  std::vector<std::size_t> nearest(mesh.positions.size());
  std::vector<double> rest;
  if (!old.empty()) {
    const points::NeighbourSearch search(old);
    std::vector<points::Neighbour> found;
    for (std::size_t i = 0; i < nearest.size(); ++i) {
      search.nearest(mesh.positions[i], 1, found);
      nearest[i] = found.empty() ? 0 : found[0].index;
    }
    const Attributes gathered = attributes.gathered(nearest);
    const auto values = gathered.values(kRest, 3);
    rest.assign(values.begin(), values.end());
  } else {
    for (const Vec3& p : mesh.positions) rest.insert(rest.end(), {p.x(), p.y(), p.z()});
  }
  mesh.attributes.set(kRest, 3, std::move(rest));
}

void TrackJob::begin_tracking(mesh::Mesh mesh, double time, const RunControl& run) {
  if (!options_.points) {
    mesh_.emplace(std::move(mesh), *surface_.field, time, options_.tracker, run);
    return;
  }
  points::Cloud cloud{std::move(mesh.positions), std::move(mesh.attributes)};
  points_.emplace(std::move(cloud), *surface_.field, time, voxel_ > 0 ? voxel_ : 1, options_.tracker, run);
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
  mesh::Mesh mesh = new_mesh(run);
  inherit(mesh, {}, {});
  topology_ = topology(run);
  begin_tracking(std::move(mesh), time_of(frame), run);
  TrackJobFrame out;
  out.remeshed = "first";
  out.step = points_ ? points_->measures() : mesh_->measures();
  return out;
}

motion::StepReport TrackJob::carry(long frame, const RunControl& run) {
  const double to = time_of(frame);
  if (sequence()) surface_ = source_.open(frame, run);
  const auto pose = [&](double t) -> const field::Field& {
    if (!sequence()) surface_.field->set_time(t);
    return *surface_.field;
  };
  return points_ ? points_->advance(pose, to, run) : mesh_->advance(pose, to, run);
}

TrackJobFrame TrackJob::advance(long frame, const RunControl& run) {
  TrackJobFrame out;
  out.step = carry(frame, run);
  const Topology now = topology(run);
  if (now != topology_)
    out.remeshed = "topology";
  else if (out.step.lost > 0)
    out.remeshed = "lost";
  else if (mesh_ && out.step.flips * kFolded > mesh_->mesh().triangles.size())
    out.remeshed = "folded";
  topology_ = now;
  if (out.remeshed.empty()) return out;
  const motion::StepReport step = out.step;
  mesh::Mesh mesh = new_mesh(run);
  if (points_)
    inherit(mesh, points_->cloud().positions, points_->cloud().attributes);
  else
    inherit(mesh, mesh_->mesh().positions, mesh_->mesh().attributes);
  begin_tracking(std::move(mesh), time_of(frame), run);
  out.step = points_ ? points_->measures() : mesh_->measures();
  out.step.lost = step.lost;  // what the step did stays in the report; the measures are the new mesh's
  out.step.seconds_velocity = step.seconds_velocity;
  out.step.seconds_fairing = step.seconds_fairing;
  return out;
}

void TrackJob::write(const TrackJobFrame& frame) const {
  if (points_)
    io::write_cloud(frame.path, points_->cloud(), options_.write);
  else
    io::write_mesh(frame.path, mesh_->mesh(), options_.write);
}

}  // namespace

std::vector<TrackJobFrame> run_track_job(const SurfaceSource& source, const TrackJobOptions& options,
                                         const std::function<void(const TrackJobFrame&)>& on_frame, RunControl run) {
  if (options.voxel && !(std::isfinite(*options.voxel) && *options.voxel > 0))
    throw InvalidInput("the voxel must be above zero");
  if (source.kind() == SurfaceSource::Kind::Particles && options.tracker.integrator == motion::Integrator::RungeKutta4)
    throw InvalidInput("a particle sequence has no frames between frames: use Euler's or Heun's method");
  const std::vector<long> frames = source.frames().empty() ? source.all_frames() : source.frames();
  if (frames.empty()) throw InvalidInput("the input has no frames to track over");
  const std::vector<std::string> names = output_names(options.output, frames);

  TrackJob job(source, options);
  std::vector<TrackJobFrame> report;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const double count = static_cast<double>(frames.size());
    const RunControl part = run.part(static_cast<double>(i) / count, static_cast<double>(i + 1) / count);
    part.check();
    part.progress(0, "frame " + std::to_string(frames[i]));
    const auto started = std::chrono::steady_clock::now();
    TrackJobFrame out = i == 0 ? job.start(frames[i], part) : job.advance(frames[i], part);
    out.frame = frames[i];
    out.path = names[i];
    job.fill(out);
    job.write(out);
    out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    part.progress(1, "frame " + std::to_string(frames[i]));
    report.push_back(out);
    if (on_frame) on_frame(report.back());
  }
  return report;
}

}  // namespace meniscus::scene
