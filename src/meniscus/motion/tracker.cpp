#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>
#include <meniscus/motion/tracker.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <chrono>
#include <cmath>

namespace meniscus::motion {
namespace {

constexpr int kNewtonSteps = 12;
constexpr double kOnSurface = 1e-12;      // of the way allowed: near enough
constexpr double kSmallestRatio = 1e-12;  // of areas
constexpr double kStiffness = 0.5;        // of the mean displacement that the springs ask for

using VelocityOf = FunctionRef<std::vector<Vec3>(const field::Field&, const std::vector<Vec3>&)>;

class Clock {
 public:
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

std::vector<Vec3> moved(const std::vector<Vec3>& x, const std::vector<Vec3>& v, double dt) {
  std::vector<Vec3> y(x);
  for (std::size_t i = 0; i < x.size(); ++i) y[i] += dt * v[i];
  return y;
}

/// Mean velocity over a step that starts with `first`.
std::vector<Vec3> step_velocity(const std::vector<Vec3>& x, const std::vector<Vec3>& first, double from, double to,
                                Integrator integrator, PoseAt pose, VelocityOf velocity) {
  if (integrator == Integrator::Euler) return first;
  const double dt = to - from;
  std::vector<Vec3> mean(first);
  if (integrator == Integrator::Heun) {
    const auto last = velocity(pose(to), moved(x, first, dt));
    for (std::size_t i = 0; i < x.size(); ++i) mean[i] = 0.5 * (first[i] + last[i]);
    return mean;
  }
  const double middle = from + dt / 2;
  const auto second = velocity(pose(middle), moved(x, first, dt / 2));
  const auto third = velocity(pose(middle), moved(x, second, dt / 2));
  const auto last = velocity(pose(to), moved(x, third, dt));
  for (std::size_t i = 0; i < x.size(); ++i) mean[i] = (first[i] + 2 * second[i] + 2 * third[i] + last[i]) / 6;
  return mean;
}

std::vector<double> flat(const std::vector<Vec3>& v) {
  std::vector<double> numbers;
  numbers.reserve(3 * v.size());
  for (const Vec3& u : v) numbers.insert(numbers.end(), {u.x(), u.y(), u.z()});
  return numbers;
}

void count(const Velocities& v, StepReport& report) {
  for (std::size_t i = 0; i < v.distance.size(); ++i) {
    report.max_distance = std::max(report.max_distance, v.distance[i]);
    report.singular += v.singular[i];
  }
}

std::vector<double> areas(const mesh::Mesh& mesh) {
  std::vector<double> result;
  result.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    const auto corner = [&](std::size_t k) { return mesh.positions[static_cast<std::size_t>(t[k])]; };
    result.push_back(0.5 * (corner(1) - corner(0)).cross(corner(2) - corner(0)).norm());
  }
  return result;
}

void project_block(const field::Field& field, std::vector<Vec3>& points, std::span<const double> reach, std::size_t begin,
                   std::size_t end, std::uint8_t* lost) {
  const std::size_t n = end - begin;
  field::PositionBatch x(n);
  std::vector<std::size_t> active;
  for (std::size_t k = 0; k < n; ++k) active.push_back(begin + k);
  std::vector<Vec3> start(points.begin() + static_cast<std::ptrdiff_t>(begin),
                          points.begin() + static_cast<std::ptrdiff_t>(end));
  field::JetBatch jets(n, field::Order::Gradient);
  for (int step = 0; step < kNewtonSteps && !active.empty(); ++step) {
    for (std::size_t k = 0; k < active.size(); ++k) x.set(k, points[active[k]]);
    const field::JetView view = jets.view();
    field.evaluate(x.view().part(0, active.size()), {view.rows, view.stride, active.size(), view.order});
    std::size_t kept = 0;
    for (std::size_t k = 0; k < active.size(); ++k) {
      const std::size_t i = active[k];
      const Vec3 g = view.gradient(k);
      const double squared = g.squaredNorm();
      const Vec3 move = squared > 0 ? Vec3(-view.value(k) / squared * g) : Vec3::Constant(view.value(k) == 0 ? 0 : 1e300);
      const Vec3 next = points[i] + move;
      if (!((next - start[i - begin]).norm() <= reach[i])) {
        points[i] = start[i - begin];
        lost[i] = 1;
        continue;
      }
      points[i] = next;
      if (move.norm() > kOnSurface * reach[i]) active[kept++] = i;
    }
    active.resize(kept);
  }
}

}  // namespace

std::size_t project(const field::Field& field, std::vector<Vec3>& points, std::span<const double> reach,
                    const RunControl& run, std::vector<std::uint8_t>* lost) {
  std::vector<std::uint8_t> own(points.size());
  parallel_blocks(points.size(), field::kBlock, run,
                  [&](std::size_t begin, std::size_t end) { project_block(field, points, reach, begin, end, own.data()); });
  const auto total = static_cast<std::size_t>(std::count(own.begin(), own.end(), 1));
  if (lost != nullptr) lost->swap(own);
  return total;
}

void fair(const field::Field& field, mesh::Mesh& mesh, int rounds, const RunControl& run, std::size_t fixed) {
  const mesh::IndexLists ring = mesh::vertex_neighbours(mesh);
  std::vector<Vec3> next(mesh.positions.size());
  std::vector<double> reach(mesh.positions.size());
  for (int round = 0; round < rounds; ++round) {
    const auto jets = field::evaluate(field, mesh.positions, field::Order::Gradient, run);
    parallel_for(next.size(), 1024, run, [&](std::size_t i) {
      const Vec3& x = mesh.positions[i];
      next[i] = x;
      reach[i] = 0;
      if (i < fixed || ring[i].empty()) return;
      Vec3 mean = Vec3::Zero();
      for (const std::int32_t j : ring[i]) {
        mean += mesh.positions[static_cast<std::size_t>(j)] - x;
        reach[i] += (mesh.positions[static_cast<std::size_t>(j)] - x).norm();
      }
      mean *= kStiffness / static_cast<double>(ring[i].size());
      reach[i] *= 0.5 / static_cast<double>(ring[i].size());
      const Vec3 n = jets.gradient(i).norm() > 0 ? Vec3(jets.gradient(i).normalized()) : Vec3(Vec3::Zero());
      next[i] += mean - n.dot(mean) * n;
    });
    mesh.positions.swap(next);
    project(field, mesh.positions, reach, run);
  }
}

MeshTracker::MeshTracker(mesh::Mesh mesh, const field::Field& field, double time, const TrackerOptions& options,
                         const RunControl& run)
    : mesh_(std::move(mesh)), options_(options), time_(time) {
  if (options_.fairing < 0) throw InvalidInput("the number of fairing rounds must not be negative");
  measure_references();
  velocities_ = evaluate(field, mesh_.positions, run);
  write_attributes();
}

void MeshTracker::measure_references() {
  neighbours_ = mesh::vertex_neighbours(mesh_);
  references_.areas = areas(mesh_);
  lost_.assign(mesh_.positions.size(), 0);
  references_.lengths.clear();
  references_.lengths.reserve(neighbours_.items.size());
  for (std::size_t i = 0; i < neighbours_.size(); ++i)
    for (const std::int32_t j : neighbours_[i])
      references_.lengths.push_back((mesh_.positions[static_cast<std::size_t>(j)] - mesh_.positions[i]).norm());
}

References MeshTracker::references() const {
  return {references_.lengths, references_.areas, velocities_.velocity,
          solver_ ? solver_->memory() : IsometricSolver::Memory{}};
}

void MeshTracker::set_references(References references) {
  if (references.lengths.size() != references_.lengths.size() || references.areas.size() != references_.areas.size() ||
      references.velocity.size() != velocities_.velocity.size())
    throw InvalidInput("the references are those of another mesh");
  references_ = std::move(references);
  velocities_.velocity.swap(references_.velocity);
  references_.velocity.clear();
  if (!references_.isometric.positions.empty()) solver_.emplace(mesh_).recall(std::move(references_.isometric));
  references_.isometric = {};
  write_attributes();
}

void MeshTracker::replace(mesh::Mesh mesh, std::span<const std::int32_t> kept_vertices,
                          std::span<const std::int32_t> kept_triangles, const field::Field& field, const RunControl& run) {
  const mesh::IndexLists old_neighbours = std::move(neighbours_);
  const References old_references = std::move(references_);
  mesh_ = std::move(mesh);
  measure_references();
  for (std::size_t f = 0; f < kept_triangles.size(); ++f)
    references_.areas[f] = old_references.areas[static_cast<std::size_t>(kept_triangles[f])];
  for (std::size_t i = 0; i < kept_vertices.size(); ++i) {
    const auto from = static_cast<std::size_t>(kept_vertices[i]);
    const auto old = old_neighbours[from];
    for (std::size_t k = 0; k < neighbours_[i].size(); ++k) {
      const auto j = static_cast<std::size_t>(neighbours_[i][k]);
      if (j >= kept_vertices.size()) continue;
      const auto found = std::lower_bound(old.begin(), old.end(), kept_vertices[j]);
      if (found == old.end() || *found != kept_vertices[j]) continue;
      references_.lengths[neighbours_.begin[i] + k] =
          old_references.lengths[old_neighbours.begin[from] + static_cast<std::size_t>(found - old.begin())];
    }
  }
  solver_.reset();
  velocities_ = evaluate(field, mesh_.positions, run);
  write_attributes();
}

Velocities MeshTracker::evaluate(const field::Field& field, std::span<const Vec3> x, const RunControl& run) {
  VelocityOptions options = options_.velocity;
  const bool isometric = options.kind == Velocity::Isometric;
  if (isometric) options.kind = Velocity::Blended;
  Velocities v = motion::velocities(field, x, options, run);
  if (!isometric) return v;
  if (!solver_) solver_.emplace(mesh_);
  solver_->solve(x, v, run);
  return v;
}

std::vector<double> MeshTracker::half_ring_lengths() const {
  std::vector<double> half(mesh_.positions.size());
  for (std::size_t i = 0; i < half.size(); ++i) {
    for (const std::int32_t j : neighbours_[i])
      half[i] += (mesh_.positions[static_cast<std::size_t>(j)] - mesh_.positions[i]).norm();
    if (!neighbours_[i].empty()) half[i] *= 0.5 / static_cast<double>(neighbours_[i].size());
  }
  return half;
}

/// One Jacobi step of the springs, in the tangent plane, and one Newton step (4.3) back.
void MeshTracker::spring_round(const field::Field& field, const RunControl& run) {
  const std::vector<Vec3>& x = mesh_.positions;
  std::vector<Vec3> next(x);
  std::vector<double> length(x.size());
  parallel_for(x.size(), 512, run, [&](std::size_t i) {
    if (neighbours_[i].empty() || lost_[i] != 0) return;
    Vec3 pull = Vec3::Zero();
    for (std::size_t k = neighbours_.begin[i]; k < neighbours_.begin[i + 1]; ++k) {
      const Vec3 e = x[static_cast<std::size_t>(neighbours_.items[k])] - x[i];
      const double now = e.norm();
      if (now > 0) pull += (1 - references_.lengths[k] / now) * e;
    }
    pull *= kStiffness / static_cast<double>(neighbours_[i].size());
    const Vec3& n = velocities_.normal[i];
    pull -= n.dot(pull) * n;
    next[i] += pull;
    length[i] = pull.norm();
  });
  parallel_blocks(next.size(), field::kBlock, run, [&](std::size_t begin, std::size_t end) {
    field::PositionBatch at(end - begin);
    field::JetBatch jets(end - begin, field::Order::Gradient);
    for (std::size_t i = begin; i < end; ++i) at.set(i - begin, next[i]);
    field.evaluate(at.view(), jets.view());
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 g = jets.gradient(i - begin);
      const double squared = g.squaredNorm();
      if (!(squared > 0) || !std::isfinite(squared)) continue;
      const Vec3 back = -jets.value(i - begin) / squared * g;
      if (!(back.norm() <= length[i])) continue;
      next[i] += back;
      velocities_.normal[i] = g / std::sqrt(squared);
    }
  });
  mesh_.positions.swap(next);
}

StepReport MeshTracker::advance(PoseAt pose, double to, const RunControl& run) {
  if (!std::isfinite(to)) throw InvalidInput("the time is not finite");
  const Clock clock;
  const std::vector<double> half = half_ring_lengths();
  const std::vector<Vec3> v =
      step_velocity(mesh_.positions, velocities_.velocity, time_, to, options_.integrator, pose,
                    [&](const field::Field& f, const std::vector<Vec3>& x) { return evaluate(f, x, run).velocity; });
  mesh_.positions = moved(mesh_.positions, v, to - time_);
  std::vector<double> reach(half);
  for (std::size_t i = 0; i < reach.size(); ++i) reach[i] = std::max(half[i], v[i].norm() * std::abs(to - time_));
  const field::Field& field = pose(to);
  time_ = to;
  const std::size_t lost = project(field, mesh_.positions, reach, run, &lost_);
  double fairing = 0;
  if (options_.fairing > 0) {
    const Clock fairing_clock;
    for (int round = 0; round < options_.fairing; ++round) spring_round(field, run);
    for (std::size_t i = 0; i < reach.size(); ++i)
      if (lost_[i] != 0) reach[i] = 0;
    project(field, mesh_.positions, reach, run);
    fairing = fairing_clock.seconds();
  }
  velocities_ = evaluate(field, mesh_.positions, run);
  write_attributes();
  const double taken = clock.seconds();
  StepReport report = measures();
  report.lost = lost;
  report.seconds_fairing = fairing;
  report.seconds_velocity = taken - fairing;
  return report;
}

StepReport MeshTracker::measures() const {
  StepReport report;
  count(velocities_, report);
  const std::vector<double> area = areas(mesh_);
  double sum = 0;
  for (std::size_t f = 0; f < area.size(); ++f) {
    const Triangle& t = mesh_.triangles[f];
    const auto a = static_cast<std::size_t>(t[0]);
    const auto b = static_cast<std::size_t>(t[1]);
    const auto c = static_cast<std::size_t>(t[2]);
    const double ratio =
        std::clamp(references_.areas[f] > 0 ? area[f] / references_.areas[f] : 1, kSmallestRatio, 1 / kSmallestRatio);
    sum += std::abs(std::log(ratio));
    report.area_log_max = std::max(report.area_log_max, std::abs(std::log(ratio)));
    const Vec3 facing = (mesh_.positions[b] - mesh_.positions[a]).cross(mesh_.positions[c] - mesh_.positions[a]);
    if (facing.dot(velocities_.normal[a] + velocities_.normal[b] + velocities_.normal[c]) < 0) ++report.flips;
  }
  report.area_log_mean = area.empty() ? 0 : sum / static_cast<double>(area.size());
  return report;
}

void MeshTracker::write_attributes() {
  mesh_.attributes.set(attribute::kNormal, 3, flat(velocities_.normal));
  mesh_.attributes.set(attribute::kVelocity, 3, flat(velocities_.velocity));
  mesh_.attributes.set_integers(kSingular, 1, {velocities_.singular.begin(), velocities_.singular.end()});
}

PointTracker::PointTracker(points::Cloud cloud, const field::Field& field, double time, double spacing,
                           const TrackerOptions& options, const RunControl& run)
    : cloud_(std::move(cloud)), options_(options), time_(time), spacing_(spacing) {
  if (!(std::isfinite(spacing) && spacing > 0)) throw InvalidInput("the spacing must be above zero");
  velocities_ = motion::velocities(field, cloud_.positions, options_.velocity, run);
  write_attributes();
}

void PointTracker::write_attributes() {
  cloud_.attributes.set(attribute::kNormal, 3, flat(velocities_.normal));
  cloud_.attributes.set(attribute::kVelocity, 3, flat(velocities_.velocity));
  cloud_.attributes.set_integers(kSingular, 1, {velocities_.singular.begin(), velocities_.singular.end()});
}

StepReport PointTracker::advance(PoseAt pose, double to, const RunControl& run) {
  if (!std::isfinite(to)) throw InvalidInput("the time is not finite");
  const Clock clock;
  const std::vector<Vec3> v = step_velocity(cloud_.positions, velocities_.velocity, time_, to, options_.integrator, pose,
                                            [&](const field::Field& f, const std::vector<Vec3>& x) {
                                              return motion::velocities(f, x, options_.velocity, run).velocity;
                                            });
  cloud_.positions = moved(cloud_.positions, v, to - time_);
  std::vector<double> reach(v.size());
  for (std::size_t i = 0; i < reach.size(); ++i) reach[i] = std::max(spacing_ / 2, v[i].norm() * std::abs(to - time_));
  const field::Field& field = pose(to);
  time_ = to;
  std::vector<std::uint8_t> lost;
  const std::size_t count_lost = project(field, cloud_.positions, reach, run, &lost);
  if (count_lost > 0) {
    std::vector<std::size_t> kept;
    for (std::size_t i = 0; i < lost.size(); ++i)
      if (lost[i] == 0) kept.push_back(i);
    cloud_ = points::gathered(cloud_, kept);
  }
  velocities_ = motion::velocities(field, cloud_.positions, options_.velocity, run);
  write_attributes();
  StepReport report = measures();
  report.lost = count_lost;
  report.seconds_velocity = clock.seconds();
  return report;
}

StepReport PointTracker::measures() const {
  StepReport report;
  count(velocities_, report);
  return report;
}

}  // namespace meniscus::motion
