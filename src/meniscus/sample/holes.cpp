#include <meniscus/base/parallel.h>
#include <meniscus/sample/holes.h>
#include <meniscus/sample/surface_cell.h>
#include <meniscus/sample/walk.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace meniscus::sample {
namespace {

constexpr int kWalkSteps = 6;
constexpr int kCenterings = 2;
constexpr double kOnSurface = 1e-9;    // spacings
constexpr double kLongestShift = 0.5;  // spacings that a centring may move a place

/// Places on the surface that may be middles of empty circles, and the particle that each belongs to.
struct Places {
  SurfacePoints points;
  std::vector<std::uint32_t> particle;
  std::vector<Vec3> offset;

  void add(const SurfacePoints& all, std::uint32_t i, const Vec3& target) {
    points.push_back(all.position(i), all.normal(i));
    particle.push_back(i);
    offset.emplace_back(target - all.position(i));
  }
};

/// The three particles nearest to a place, unrolled into its tangent plane.
struct Nearest {
  std::array<Vec3, 3> offset;
  std::array<double, 3> distance;
  int count = 0;

  void take(const Vec3& d, double length) {
    int k = std::min(count, 2);
    if (count == 3 && length >= distance[2]) return;
    for (; k > 0 && distance[static_cast<std::size_t>(k - 1)] > length; --k) {
      distance[static_cast<std::size_t>(k)] = distance[static_cast<std::size_t>(k - 1)];
      offset[static_cast<std::size_t>(k)] = offset[static_cast<std::size_t>(k - 1)];
    }
    distance[static_cast<std::size_t>(k)] = length;
    offset[static_cast<std::size_t>(k)] = d;
    count = std::min(count + 1, 3);
  }

  /// From the place to the point as far from all three; zero when they lie in a line.
  Vec3 to_middle() const {
    if (count < 3) return Vec3::Zero();
    const Vec3 a = offset[1] - offset[0], b = offset[2] - offset[0], c = a.cross(b);
    const double twice = 2 * c.squaredNorm();
    if (!(twice > 1e-6 * a.squaredNorm() * b.squaredNorm())) return Vec3::Zero();
    return offset[0] + (a.squaredNorm() * b.cross(c) + b.squaredNorm() * c.cross(a)) / twice;
  }
};

Nearest nearest(const SurfacePoints& points, const Neighbours& neighbours, std::uint32_t i, const Vec3& q, const Vec3& n) {
  Nearest found;
  const auto look_at = [&](std::uint32_t j) {
    const Vec3 d = points.position(j) - q, m = points.normal(j);
    if (!(same_sheet(n.x(), n.y(), n.z(), m.x(), m.y(), m.z()) > 0)) return;
    const double length = d.norm() * arc_over_chord(d, n, m);
    Vec3 flat = d - d.dot(n) / 3 * (m - n);
    flat -= flat.dot(n) * n;
    if (flat.norm() > 0) flat *= length / flat.norm();
    found.take(flat, length);
  };
  look_at(i);
  for (const std::uint32_t j : neighbours.of(i)) look_at(j);
  return found;
}

/// Every corner of the cells that cannot be trusted, where a walk of its length and direction ends.
Places walked_corners(const field::Field& surface, const Box& box, const SurfacePoints& points,
                      std::span<const double> spacing, const Neighbours& neighbours, std::span<const CellMeasure> cells,
                      const RunControl& run) {
  Places places;
  SurfaceCell cell;
  double widest = 0;
  for (std::uint32_t i = 0; i < cells.size(); ++i) {
    if (!cells[i].bent && !cells[i].open) continue;
    widest = std::max(widest, spacing[i]);
    cell.build(points, i, neighbours.of(i), kCellLimit * spacing[i], box);
    for (int k = 0; k < cell.sides(); ++k) places.add(points, i, cell.corner(k));
  }
  const auto arrived = walk(surface, box, places.offset, kWalkSteps, kOnSurface * widest, places.points, run);
  std::vector<std::uint32_t> kept;
  for (std::uint32_t k = 0; k < arrived.size(); ++k)
    if (arrived[k]) kept.push_back(k);
  return {places.points.gathered(kept), gathered(places.particle, kept), gathered(places.offset, kept)};
}

/// The largest of the empty circles about each particle, by falling radius.
std::vector<Hole> largest_each(std::vector<Hole> holes, double least) {
  std::erase_if(holes, [least](const Hole& h) { return !(h.radius >= least); });
  std::stable_sort(holes.begin(), holes.end(), [](const Hole& a, const Hole& b) {
    return a.particle < b.particle || (a.particle == b.particle && a.radius > b.radius);
  });
  const auto same = [](const Hole& a, const Hole& b) { return a.particle == b.particle; };
  holes.erase(std::unique(holes.begin(), holes.end(), same), holes.end());
  std::stable_sort(holes.begin(), holes.end(), [](const Hole& a, const Hole& b) { return a.radius > b.radius; });
  return holes;
}

}  // namespace

std::vector<Hole> find_holes(const field::Field& surface, const Box& box, const SurfacePoints& points,
                             std::span<const double> spacing, const Neighbours& neighbours,
                             std::span<const CellMeasure> cells, double least, const RunControl& run) {
  std::vector<Hole> holes;
  Places flat;
  for (std::uint32_t i = 0; i < cells.size(); ++i)
    if (!cells[i].bent && !cells[i].open && cells[i].farthest >= least * cells[i].local_spacing)
      flat.add(points, i, cells[i].corner);
  const double widest = spacing.empty() ? 0 : *std::max_element(spacing.begin(), spacing.end());
  const auto arrived = walk(surface, box, flat.offset, 1, kOnSurface * widest, flat.points, run);
  for (std::size_t k = 0; k < arrived.size(); ++k) {
    const CellMeasure& c = cells[flat.particle[k]];
    if (arrived[k])
      holes.push_back({flat.points.position(k), flat.points.normal(k), c.farthest / c.local_spacing, flat.particle[k]});
  }

  Places bent = walked_corners(surface, box, points, spacing, neighbours, cells, run);
  for (int round = 0; round <= kCenterings && !bent.points.empty(); ++round) {
    const std::size_t first = holes.size();
    holes.resize(first + bent.points.size());
    parallel_for(bent.points.size(), 256, run, [&](std::size_t k) {
      const std::uint32_t i = bent.particle[k];
      const Vec3 q = bent.points.position(k), n = bent.points.normal(k);
      const Nearest near = nearest(points, neighbours, i, q, n);
      holes[first + k] = {q, n, near.count > 0 ? near.distance[0] / cells[i].local_spacing : 0, i};
      bent.offset[k] = near.to_middle();
      if (bent.offset[k].norm() > kLongestShift * spacing[i]) bent.offset[k].setZero();
    });
    if (round < kCenterings) walk(surface, box, bent.offset, 2, kOnSurface * widest, bent.points, run);
  }
  return largest_each(std::move(holes), least);
}

}  // namespace meniscus::sample
