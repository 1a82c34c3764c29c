#include <meniscus/base/error.h>
#include <meniscus/mesh/validate.h>
#include <meniscus/points/neighbours.h>
#include <meniscus/polygonize/mend.h>
#include <meniscus/polygonize/polygonize.h>
#include <meniscus/scene/identity.h>
#include <meniscus/scene/inherit.h>
#include <meniscus/scene/point_population.h>
#include <meniscus/scene/tracked_surface.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace meniscus::scene {
namespace {

constexpr double kResolution = 0.25;  // of a voxel
constexpr std::size_t kFolded = 100;  // a mesh with one triangle in so many turned over is done with
constexpr double kStartReach = 2;     // voxels that a given mesh may be off the surface

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

bool above_zero(const std::optional<double>& number) { return !number || (std::isfinite(*number) && *number > 0); }

/// What the step did stays in a report; the measures become those of what is tracked now.
void measure_anew(motion::StepReport& report, const motion::StepReport& now) {
  const motion::StepReport step = std::exchange(report, now);
  report.lost = step.lost;
  report.seconds_velocity = step.seconds_velocity;
  report.seconds_fairing = step.seconds_fairing;
}

}  // namespace

TrackedSurface::TrackedSurface(const SurfaceSource& source, TrackOptions options)
    : source_(source), options_(std::move(options)) {
  if (!above_zero(options_.voxel)) throw InvalidInput("the voxel must be above zero");
  if (!above_zero(options_.checker)) throw InvalidInput("the squares of a checkerboard must be above zero");
  if (source.kind() == SurfaceSource::Kind::Particles && options_.tracker.integrator == motion::Integrator::RungeKutta4)
    throw InvalidInput("a particle sequence has no frames between frames: use Euler's or Heun's method");
  if (!options_.start || options_.points) return;
  if (options_.start->kind != io::Geometry::Kind::Mesh)
    throw InvalidInput("what tracking begins with has no triangles: it can be tracked as points");
  const mesh::Audit audit = mesh::validate(options_.start->mesh);
  if (!audit.good()) throw InvalidInput("the mesh that tracking begins with is no closed surface: " + mesh::summary(audit));
}

/// A mesh says nothing of what is smaller than a fraction of its cells.
motion::TrackerOptions TrackedSurface::tracking() const {
  motion::TrackerOptions options = options_.tracker;
  if (!options.velocity.resolution) options.velocity.resolution = kResolution * voxel_;
  return options;
}

void TrackedSurface::open(long frame, const RunControl& run) {
  surface_ = source_.open(frame, run);
  voxel_ = options_.voxel.value_or(surface_.voxel);
  if (!(voxel_ > 0)) voxel_ = 1;
}

polygonize::PolygonizeOptions TrackedSurface::meshing() const {
  const Box bounds = surface_.field->bounds();
  if (!bounds.finite() && !bounds.empty()) throw InvalidInput("the surface is unbounded: it cannot be meshed whole");
  return {.voxel = voxel_, .count_components = false};
}

/// What the signs of F on the lattice say; vertices are near the surface only.
mesh::Mesh TrackedSurface::lattice_surface(const RunControl& run) const {
  auto options = meshing();
  options.projection = 0;
  options.normals = false;
  return polygonize::polygonize(*surface_.field, options, run).mesh;
}

mesh::Mesh TrackedSurface::new_mesh(const RunControl& run) const {
  return polygonize::polygonize(*surface_.field, meshing(), run).mesh;
}

Attributes TrackedSurface::first_attributes(const std::vector<Vec3>& positions) const {
  Attributes attributes;
  set_rest(attributes, positions);
  if (options_.checker) attributes.set(attribute::kColor, 3, checkered(positions, *options_.checker));
  return attributes;
}

TrackStep TrackedSurface::go_to(long frame, const RunControl& run) {
  if (++steps_ == 0) return start(frame, run);
  return points_ ? advance_points(frame, run) : advance_mesh(frame, run);
}

/// Gives what tracking begins with what it carries: rest, ids of its own or new ones, and paint.
void TrackedSurface::identify(Attributes& attributes, const std::vector<Vec3>& positions) {
  for (const Attribute& a : first_attributes(positions)) attributes.set(a.name, a.components, std::get<0>(a.data));
  const auto ids = attributes.integers(attribute::kId);
  if (ids.empty()) return number(attributes, 0, positions.size(), next_id_);
  next_id_ = *std::max_element(ids.begin(), ids.end()) + 1;
}

TrackStep TrackedSurface::start(long frame, const RunControl& run) {
  open(frame, run);
  TrackStep out;
  out.change.reason = "first";
  if (options_.points) {
    points::Cloud cloud = options_.start ? given_points(run) : PointPopulation(*surface_.field, voxel_).first(run);
    identify(cloud.attributes, cloud.positions);
    points_.emplace(std::move(cloud), *surface_.field, time_of(frame), voxel_, tracking(), run);
    out.step = points_->measures();
    return out;
  }
  mesh::Mesh mesh = options_.start ? given_mesh(run) : new_mesh(run);
  if (!options_.start) {
    motion::fair(*surface_.field, mesh, options_.first_fairing, run);
    mesh.attributes = {};
  }
  identify(mesh.attributes, mesh.positions);
  mesh_.emplace(std::move(mesh), *surface_.field, time_of(frame), tracking(), run);
  out.step = mesh_->measures();
  if (!options_.start) return out;
  out.change = {fault(out.step, run), {}, mesh_->mesh().positions.size()};
  if (!out.change.reason.empty()) mend({}, out, run);
  return out;
}

mesh::Mesh TrackedSurface::given_mesh(const RunControl& run) {
  mesh::Mesh mesh = std::move(options_.start->mesh);
  const std::vector<double> reach(mesh.positions.size(), kStartReach * voxel_);
  if (2 * motion::project(*surface_.field, mesh.positions, reach, run) > mesh.positions.size())
    throw InvalidInput("the mesh that tracking begins with is not the surface of the first frame");
  return mesh;
}

points::Cloud TrackedSurface::given_points(const RunControl& run) {
  io::Geometry& start = *options_.start;
  points::Cloud cloud = std::move(start.cloud);
  if (start.kind == io::Geometry::Kind::Mesh) cloud = {std::move(start.mesh.positions), std::move(start.mesh.attributes)};
  std::vector<std::uint8_t> lost;
  const std::vector<double> reach(cloud.size(), kStartReach * voxel_);
  if (2 * motion::project(*surface_.field, cloud.positions, reach, run, &lost) > cloud.size())
    throw InvalidInput("the points that tracking begins with are not on the surface of the first frame");
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < lost.size(); ++i)
    if (lost[i] == 0) kept.push_back(i);
  return points::gathered(cloud, kept);
}

template <class Tracker>
motion::StepReport TrackedSurface::carry(Tracker& tracker, long frame, const RunControl& run) {
  const bool sequence = source_.kind() == SurfaceSource::Kind::Particles;
  if (sequence) surface_ = source_.open(frame, run);
  const auto pose = [&](double t) -> const field::Field& {
    if (!sequence) surface_.field->set_time(t);
    return *surface_.field;
  };
  return tracker.advance(pose, time_of(frame), run);
}

TrackStep TrackedSurface::advance_mesh(long frame, const RunControl& run) {
  TrackStep out;
  out.step = carry(*mesh_, frame, run);
  out.change = {fault(out.step, run), {}, mesh_->mesh().positions.size()};
  if (!out.change.reason.empty()) mend(mesh_->lost(), out, run);
  return out;
}

/// Why the mesh no longer is the surface; empty when it is.
std::string TrackedSurface::fault(const motion::StepReport& step, const RunControl& run) const {
  if (topology_of(mesh_->mesh()) != topology_of(lattice_surface(run))) return "topology";
  if (step.lost > 0) return "lost";
  if (step.flips * kFolded > mesh_->mesh().triangles.size()) return "folded";
  return stretched(run) ? "stretched" : "";
}

/// Whether some triangle's middle is farther from the surface than a mesh of this voxel may be.
bool TrackedSurface::stretched(const RunControl& run) const {
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

void TrackedSurface::mend(std::span<const std::uint8_t> lost, TrackStep& out, const RunControl& run) {
  const mesh::Mesh& old = mesh_->mesh();
  polygonize::Mended mended = polygonize::mend(old, lost, new_mesh(run), voxel_, run);
  const std::size_t kept = mended.kept_vertices.size();
  mesh::Mesh& mesh = mended.mesh;
  motion::fair(*surface_.field, mesh, options_.first_fairing, run, kept);
  mesh.attributes =
      old.positions.empty() ? first_attributes(mesh.positions) : inherited(old, mended.kept_vertices, mesh.positions);
  number(mesh.attributes, kept, mesh.positions.size(), next_id_);
  out.change.carried = kept;
  out.change.regions = std::move(mended.regions);
  mesh_->replace(std::move(mesh), mended.kept_vertices, mended.kept_triangles, *surface_.field, run);
  measure_anew(out.step, mesh_->measures());
}

TrackStep TrackedSurface::advance_points(long frame, const RunControl& run) {
  TrackStep out;
  out.step = carry(*points_, frame, run);
  const PointPopulation population(*surface_.field, voxel_);
  points::Cloud cloud = points_->cloud();
  const bool now = options_.redistribution > 0 && steps_ % options_.redistribution == 0;
  out.change.carried = now ? population.redistribute(cloud, run) : cloud.size();
  population.cover(cloud, lattice_surface(run).positions, run);
  out.born = cloud.size() - out.change.carried;
  if (now) out.change.reason = "redistributed";
  if (!now && out.born == 0) return out;
  if (points_->cloud().empty()) cloud.attributes = first_attributes(cloud.positions);
  number(cloud.attributes, out.change.carried, cloud.size(), next_id_);
  points_.emplace(std::move(cloud), *surface_.field, time_of(frame), voxel_, tracking(), run);
  measure_anew(out.step, points_->measures());
  return out;
}

band::Band TrackedSurface::band(const RunControl& run) const {
  return band::band_of(*surface_.field, voxel_, {}, 1u << 20, run);
}

std::vector<Vec3> TrackedSurface::velocities(std::span<const Vec3> at) const {
  std::vector<Vec3> result(at.size(), Vec3::Zero());
  if (points_) {
    const points::NeighbourSearch search(points_->cloud().positions);
    std::vector<points::Neighbour> found;
    for (std::size_t i = 0; i < at.size(); ++i) {
      search.nearest(at[i], 1, found);
      if (!found.empty()) result[i] = points_->velocities().velocity[found[0].index];
    }
    return result;
  }
  mesh::Mesh carrier{mesh_->mesh().positions, mesh_->mesh().triangles, {}};
  const auto own = mesh_->mesh().attributes.values(attribute::kVelocity, 3);
  carrier.attributes.set(attribute::kVelocity, 3, {own.begin(), own.end()});
  const Attributes there = inherited(carrier, {}, at);
  const auto v = there.values(attribute::kVelocity, 3);
  for (std::size_t i = 0; 3 * i < v.size(); ++i) result[i] = {v[3 * i], v[3 * i + 1], v[3 * i + 2]};
  return result;
}

TrackState TrackedSurface::state() const {
  if (points_) return {{points_->cloud().positions, {}, points_->cloud().attributes}, {}, next_id_, steps_};
  return {mesh_->mesh(), mesh_->references(), next_id_, steps_};
}

void TrackedSurface::resume(long frame, TrackState state, const RunControl& run) {
  open(frame, run);
  next_id_ = state.next_id;
  steps_ = state.steps;
  if (options_.points) {
    points::Cloud cloud{std::move(state.mesh.positions), std::move(state.mesh.attributes)};
    points_.emplace(std::move(cloud), *surface_.field, time_of(frame), voxel_, tracking(), run);
    return;
  }
  mesh_.emplace(std::move(state.mesh), *surface_.field, time_of(frame), tracking(), run);
  mesh_->set_references(std::move(state.references));
}

}  // namespace meniscus::scene
