#include <meniscus/pointset/resample.h>

#include <meniscus/base/parallel.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace meniscus::pointset {
namespace {

constexpr std::size_t kBlock = 64;
// In spacings.
constexpr double kGap = 0.78;    // an even, hexagonal set has 0.58
constexpr double kWidest = 1.6;  // wider ones are what a jagged border looks like
constexpr double kApart = 0.7;
constexpr double kCrowded = 0.5;
constexpr double kLook = 3.5;
constexpr std::size_t kMostNeighbours = 48;
constexpr double kSameSheet = 0.3;  // cosine of the angle between normals

/// A corner of a Voronoi cell that begins as a square frame.
struct Corner {
  Vec2 place;
  bool closed;  // made by neighbours alone
  bool frame;   // the edge to the next corner is the frame's
};

/// Cuts off what is nearer to `other` than to the origin.
void cut(std::vector<Corner>& cell, const Vec2& other, std::vector<Corner>& scratch) {
  const double middle = 0.5 * other.squaredNorm();
  scratch.clear();
  for (std::size_t i = 0; i < cell.size(); ++i) {
    const Corner &a = cell[i], &b = cell[(i + 1) % cell.size()];
    const double da = other.dot(a.place) - middle, db = other.dot(b.place) - middle;
    if (da <= 0) scratch.push_back(a);
    if ((da <= 0) == (db <= 0)) continue;
    const Vec2 place = a.place + da / (da - db) * (b.place - a.place);
    scratch.push_back({place, !a.frame, da > 0 && a.frame});
  }
  std::swap(cell, scratch);
}

std::optional<Vec3> largest_gap(const PointSet& set, const points::NeighbourSearch& search, std::uint32_t i, double spacing,
                                std::vector<points::Neighbour>& near) {
  const double look = kLook * spacing;
  search.nearest(set.position(i), kMostNeighbours, near);
  const Frame frame = frame_about(set.normal(i));
  std::vector<Corner> cell, scratch;
  for (const auto& [x, y] : {std::pair(-1, -1), std::pair(1, -1), std::pair(1, 1), std::pair(-1, 1)})
    cell.push_back({look * Vec2(x, y), false, true});
  for (const points::Neighbour& n : near) {
    if (n.index == i || n.squared_distance > look * look) continue;
    if (set.normal(n.index).dot(frame.w) < kSameSheet) continue;
    const Vec3 d = set.position(n.index) - set.position(i);
    const Vec2 flat(d.dot(frame.u), d.dot(frame.v));
    // Bent surfaces shorten distances: keep the true one.
    const double length = flat.norm();
    if (length > 0.3 * d.norm()) cut(cell, flat * (d.norm() / length), scratch);
  }
  double largest = kGap * kGap * spacing * spacing;
  std::optional<Vec3> gap;
  for (const Corner& c : cell) {
    if (!c.closed) return std::nullopt;
    if (c.place.squaredNorm() <= largest) continue;
    largest = c.place.squaredNorm();
    gap = set.position(i) + c.place.x() * frame.u + c.place.y() * frame.v;
  }
  if (!gap || largest > std::pow(kWidest * spacing, 2)) return std::nullopt;
  const Vec3 border = set.border(i);
  const bool beyond = !border.isZero() && border.dot(*gap - set.position(i)) > border.squaredNorm();
  return beyond ? std::nullopt : gap;
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
