#include <meniscus/base/parallel.h>
#include <meniscus/polygonize/project.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace meniscus::polygonize {
namespace {

using field::JetBatch;
using field::Order;
using field::PositionBatch;

constexpr std::size_t kVerticesPerBlock = field::kBlock;
/// How far outside its cell a vertex may go, voxels. Cells' vertices must not meet, and a vertex that runs far from its cell
/// is usually after another sheet; but a smooth surface may well have its middle a little outside.
constexpr double kMargin = 0.1;
constexpr int kBisections = 40;  // a cell's diagonal falls below 2e-12 voxels

/// Two points with the surface between them.
struct Bracket {
  Vec3 inside;
  Vec3 outside;
  Vec3 middle() const { return 0.5 * (inside + outside); }
};

/// From `start`, which is inside or not, to the nearest corner of the vertex's loop on the other side.
Bracket bracket(const Shell& shell, std::size_t vertex, const Vec3& start, bool starts_inside) {
  const VertexPlace place = place_of(shell, vertex);
  Vec3 best = place.center;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t c = 0; c < place.corners.size(); ++c) {
    const Vec3 corner = shell.lattice.point(place.corners[c]);
    const double distance = (corner - start).squaredNorm();
    // The margin keeps ties, frequent by symmetry, from being decided by rounding.
    if (place.inside[c] == starts_inside || distance >= (1 - 1e-6) * nearest) continue;
    best = corner;
    nearest = distance;
  }
  return starts_inside ? Bracket{start, best} : Bracket{best, start};
}

/// Finds where F changes sign on the way from each start to a corner of its cell. Returns the number of evaluations.
std::size_t bisect(const ClippedField& field, const Shell& shell, std::span<const std::size_t> vertices,
                   std::vector<Vec3>& points) {
  const std::size_t count = vertices.size();
  PositionBatch at(points);
  JetBatch jets(count, Order::Value);
  field.evaluate(at.view(), jets.view());
  std::vector<Bracket> brackets;
  brackets.reserve(count);
  for (std::size_t n = 0; n < count; ++n) brackets.push_back(bracket(shell, vertices[n], points[n], jets.value(n) < 0));
  for (int b = 0; b < kBisections; ++b) {
    for (std::size_t n = 0; n < count; ++n) at.set(n, brackets[n].middle());
    field.evaluate(at.view(), jets.view());
    for (std::size_t n = 0; n < count; ++n) (jets.value(n) < 0 ? brackets[n].inside : brackets[n].outside) = at.view()[n];
  }
  for (std::size_t n = 0; n < count; ++n) points[n] = brackets[n].middle();
  return count * (1 + static_cast<std::size_t>(kBisections));
}

/// The vertices of one block on their way to the surface.
class BlockProjector {
 public:
  BlockProjector(const ClippedField& field, Shell& shell, const ProjectOptions& options, std::size_t begin, std::size_t end)
      : field_(field),
        shell_(shell),
        options_(options),
        begin_(begin),
        size_(end - begin),
        value_(size_),
        gradient_(size_) {}

  ProjectReport run() {
    all_.resize(size_);
    for (std::size_t i = 0; i < size_; ++i) all_[i] = i;
    if (options_.iterations > 0) {
      start_.assign(shell_.positions.begin() + static_cast<std::ptrdiff_t>(begin_),
                    shell_.positions.begin() + static_cast<std::ptrdiff_t>(begin_ + size_));
      cells_ = cells_of(shell_, begin_, begin_ + size_);
      const std::vector<std::size_t> failed = newton();
      if (!failed.empty()) bisect_from_start(failed);
    } else if (options_.normals) {
      evaluate_here(all_);
    }
    finish();
    return report_;
  }

 private:
  Vec3& position(std::size_t i) { return shell_.positions[begin_ + i]; }
  double tolerance(std::size_t i) { return surface_tolerance(shell_.lattice, options_.tolerance, position(i)); }
  bool arrived(std::size_t i) { return std::abs(value_[i]) <= tolerance(i) * gradient_[i].norm(); }

  JetBatch evaluate(const PositionBatch& at, Order order) {
    JetBatch jets(at.x.size(), order);
    field_.evaluate(at.view(), jets.view());
    report_.evaluations += at.x.size();
    return jets;
  }

  void evaluate_here(const std::vector<std::size_t>& which) {
    PositionBatch at(which.size());
    for (std::size_t n = 0; n < which.size(); ++n) at.set(n, position(which[n]));
    const JetBatch jets = evaluate(at, Order::Gradient);
    for (std::size_t n = 0; n < which.size(); ++n) {
      value_[which[n]] = jets.value(n);
      gradient_[which[n]] = jets.gradient(n);
    }
  }

  bool allowed(std::size_t i, const Vec3& p) {
    const Vec3 in_cell = (p - shell_.lattice.point(cells_[i])) / shell_.lattice.voxel;
    return in_cell.minCoeff() >= -kMargin && in_cell.maxCoeff() <= 1 + kMargin;  // false for NaN
  }

  /// The Newton step from vertex i, at most half a voxel.
  Vec3 step(std::size_t i) {
    const Vec3 full = -value_[i] / gradient_[i].squaredNorm() * gradient_[i];
    const double reach = 0.5 * shell_.lattice.voxel;
    const double length = full.norm();
    return length > reach ? Vec3(reach / length * full) : full;
  }

  /// Returns the vertices that did not arrive.
  std::vector<std::size_t> newton() {
    evaluate_here(all_);
    std::vector<double> damping(size_, 1);
    std::vector<std::size_t> failed;
    std::vector<std::size_t> active = all_;
    for (int iteration = 0; iteration < options_.iterations; ++iteration) {
      PositionBatch trial(active.size());
      std::size_t kept = 0;
      for (const std::size_t i : active) {
        if (arrived(i)) continue;
        const Vec3 p = position(i) + damping[i] * step(i);
        if (!allowed(i, p)) {
          failed.push_back(i);
          continue;
        }
        trial.set(kept, p);
        active[kept++] = i;
      }
      active.resize(kept);
      if (kept == 0) break;
      trial.x.resize(kept);
      trial.y.resize(kept);
      trial.z.resize(kept);
      const JetBatch jets = evaluate(trial, Order::Gradient);
      for (std::size_t n = 0; n < kept; ++n) {
        const std::size_t i = active[n];
        if (std::abs(jets.value(n)) < std::abs(value_[i])) {
          position(i) = trial.view()[n];
          value_[i] = jets.value(n);
          gradient_[i] = jets.gradient(n);
          damping[i] = 1;
        } else {
          damping[i] *= 0.25;
        }
      }
    }
    for (const std::size_t i : active)
      if (!arrived(i)) failed.push_back(i);
    std::sort(failed.begin(), failed.end());
    return failed;
  }

  void bisect_from_start(const std::vector<std::size_t>& which) {
    std::vector<std::size_t> vertices;
    std::vector<Vec3> points;
    for (const std::size_t i : which) {
      vertices.push_back(begin_ + i);
      points.push_back(start_[i]);
    }
    report_.evaluations += bisect(field_, shell_, vertices, points);
    report_.bisected += which.size();
    for (std::size_t n = 0; n < which.size(); ++n) position(which[n]) = points[n];
    evaluate_here(which);
    for (const std::size_t i : which) shell_.placed[begin_ + i] = Placed::Bisected;
  }

  void finish() {
    if (options_.iterations <= 0 && !options_.normals) return;
    for (std::size_t i = 0; i < size_; ++i) {
      const double slope = gradient_[i].norm();
      if (options_.normals) shell_.normals[begin_ + i] = unit_or_zero(gradient_[i]);
      if (field_.past_box(position(i)) >= -tolerance(i)) ++report_.at_box;
      if (shell_.placed[begin_ + i] == Placed::Newton && slope > 0 && std::isfinite(slope))
        report_.worst_residual = std::max(report_.worst_residual, std::abs(value_[i]) / slope / shell_.lattice.voxel);
    }
  }

  const ClippedField& field_;
  Shell& shell_;
  const ProjectOptions& options_;
  std::size_t begin_;
  std::size_t size_;
  std::vector<double> value_;
  std::vector<Vec3> gradient_;
  std::vector<Vec3> start_;
  std::vector<Coord> cells_;
  std::vector<std::size_t> all_;
  ProjectReport report_;
};

}  // namespace

ProjectReport sum(ProjectReport a, const ProjectReport& b) {
  a.evaluations += b.evaluations;
  a.bisected += b.bisected;
  a.at_box += b.at_box;
  a.creases += b.creases;
  a.worst_residual = std::max(a.worst_residual, b.worst_residual);
  return a;
}

double surface_tolerance(const Lattice& lattice, double tolerance, const Vec3& p) {
  constexpr double kEpsilon = 8 * std::numeric_limits<double>::epsilon();
  return tolerance * lattice.voxel + kEpsilon * p.lpNorm<Eigen::Infinity>();
}

ProjectReport project(const ClippedField& field, Shell& shell, const ProjectOptions& options, const RunControl& run) {
  if (options.normals) shell.normals.resize(shell.positions.size());
  shell.placed.assign(shell.positions.size(), Placed::Newton);
  return parallel_reduce(
      shell.positions.size(), kVerticesPerBlock, run, ProjectReport{},
      [&](std::size_t begin, std::size_t end) { return BlockProjector(field, shell, options, begin, end).run(); }, sum);
}

void settle_in_cells(const ClippedField& field, Shell& shell, std::span<const std::size_t> vertices, ProjectReport& report) {
  std::vector<Vec3> points;
  for (const std::size_t v : vertices) points.push_back(place_of(shell, v).center);
  report.evaluations += bisect(field, shell, vertices, points);
  report.bisected += vertices.size();
  for (std::size_t n = 0; n < vertices.size(); ++n) {
    Placed& placed = shell.placed[vertices[n]];
    if (is_creased(placed)) --report.creases;
    placed = Placed::Bisected;
    shell.positions[vertices[n]] = points[n];
  }
  if (shell.normals.empty()) return;
  JetBatch jets(points.size(), Order::Gradient);
  field.evaluate(PositionBatch(points).view(), jets.view());
  report.evaluations += points.size();
  for (std::size_t n = 0; n < vertices.size(); ++n) shell.normals[vertices[n]] = unit_or_zero(jets.gradient(n));
}

}  // namespace meniscus::polygonize
