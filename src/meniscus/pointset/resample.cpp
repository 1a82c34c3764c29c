#include <meniscus/pointset/resample.h>

#include <meniscus/base/parallel.h>
#include <meniscus/pointset/tangent_cell.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace meniscus::pointset {
namespace {

constexpr std::size_t kBlock = 64;
// In spacings.
constexpr double kGap = 0.95;    // an even, hexagonal set has 0.58
constexpr double kWidest = 1.6;  // wider ones are what a jagged border looks like
constexpr double kApart = 0.7;
constexpr double kCrowded = 0.62;
constexpr double kLook = 3.5;
constexpr std::size_t kMostNeighbours = 96;  // two sheets' worth
constexpr double kOpen = 2.8;  // radians between directions to the points about a gap, at most: a border shows π

/// Whether points of point i's sheet stand all around `gap`, in its tangent plane, among those within twice `radius` of it.
bool surrounded(const PointSet& set, std::uint32_t i, std::span<const points::Neighbour> near, const Vec2& gap,
                double radius) {
  const Frame frame = frame_about(set.normal(i));
  std::vector<double> angles{std::atan2(-gap.y(), -gap.x())};
  for (const points::Neighbour& n : near) {
    if (n.index == i) continue;
    const auto place = flattened(set, frame, i, n.index);
    if (place && (*place - gap).norm() < 2 * radius)
      angles.push_back(std::atan2(place->y() - gap.y(), place->x() - gap.x()));
  }
  std::sort(angles.begin(), angles.end());
  double widest = angles.front() + 2 * std::numbers::pi - angles.back();
  for (std::size_t k = 1; k < angles.size(); ++k) widest = std::max(widest, angles[k] - angles[k - 1]);
  return widest < kOpen;
}

std::optional<Vec3> largest_gap(const PointSet& set, const points::NeighbourSearch& search, std::uint32_t i, double spacing,
                                std::vector<points::Neighbour>& near) {
  const double look = kLook * spacing;
  search.nearest(set.position(i), kMostNeighbours, near);
  std::vector<Vec2> cell;
  tangent_cell(set, i, near, look, cell);
  const Vec2 corner = *std::max_element(cell.begin(), cell.end(),
                                        [](const Vec2& a, const Vec2& b) { return a.squaredNorm() < b.squaredNorm(); });
  // A cell that neighbours do not close keeps corners of the square, which is wider than the widest gap.
  const double radius = corner.norm() / spacing;
  if (radius < kGap || radius > kWidest || !surrounded(set, i, near, corner, corner.norm())) return std::nullopt;
  const Frame frame = frame_about(set.normal(i));
  const Vec3 gap = set.position(i) + corner.x() * frame.u + corner.y() * frame.v;
  const Vec3 border = set.border(i);
  const bool beyond = !border.isZero() && border.dot(gap - set.position(i)) > border.squaredNorm();
  return beyond ? std::nullopt : std::optional<Vec3>(gap);
}

}  // namespace

std::vector<Gap> find_gaps(const PointSet& set, const points::NeighbourSearch& search, std::span<const std::uint32_t> about,
                           double spacing, const RunControl& run) {
  std::vector<std::optional<Vec3>> candidates(about.size());
  parallel_blocks(about.size(), kBlock, run, [&](std::size_t begin, std::size_t end) {
    std::vector<points::Neighbour> near;
    for (std::size_t k = begin; k < end; ++k) candidates[k] = largest_gap(set, search, about[k], spacing, near);
  });
  std::vector<Vec3> places;
  std::vector<std::uint32_t> like;
  for (std::size_t k = 0; k < about.size(); ++k)
    if (candidates[k]) places.push_back(*candidates[k]), like.push_back(about[k]);

  // The same gap is seen from several points: the first keeps it.
  const points::NeighbourSearch others(places);
  std::vector<char> taken(places.size(), 0);
  std::vector<points::Neighbour> near;
  std::vector<Gap> gaps;
  for (std::uint32_t k = 0; k < places.size(); ++k) {
    others.within(places[k], kApart * spacing, near);
    if (std::any_of(near.begin(), near.end(), [&](const points::Neighbour& n) { return taken[n.index]; })) continue;
    taken[k] = 1;
    gaps.push_back({places[k], like[k]});
  }
  return gaps;
}

std::vector<std::uint32_t> find_crowded(const PointSet& set, const points::NeighbourSearch& search,
                                        std::span<const std::uint32_t> about, double spacing) {
  // A point goes if one that stays is near: of those in question the first stay.
  std::vector<char> stays(set.size(), 1);
  for (const std::uint32_t i : about) stays[i] = 0;
  std::vector<std::uint32_t> crowded;
  std::vector<points::Neighbour> near;
  for (const std::uint32_t i : about) {
    search.within(set.position(i), kCrowded * spacing, near);
    const bool close = std::any_of(near.begin(), near.end(), [&](const points::Neighbour& n) {
      return stays[n.index] && set.normal(n.index).dot(set.normal(i)) > kSameSheet;
    });
    if (close)
      crowded.push_back(i);
    else
      stays[i] = 1;
  }
  return crowded;
}

}  // namespace meniscus::pointset
