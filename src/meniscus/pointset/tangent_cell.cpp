#include <meniscus/pointset/tangent_cell.h>

#include <utility>

namespace meniscus::pointset {
namespace {

/// Cuts off of a convex cell, given by its corners, what is nearer to `other` than to the origin.
void cut(std::vector<Vec2>& cell, const Vec2& other, std::vector<Vec2>& scratch) {
  const double middle = 0.5 * other.squaredNorm();
  scratch.clear();
  for (std::size_t i = 0; i < cell.size(); ++i) {
    const Vec2 &a = cell[i], &b = cell[(i + 1) % cell.size()];
    const double da = other.dot(a) - middle, db = other.dot(b) - middle;
    if (da <= 0) scratch.push_back(a);
    if ((da <= 0) != (db <= 0)) scratch.emplace_back(a + da / (da - db) * (b - a));
  }
  std::swap(cell, scratch);
}

}  // namespace

std::optional<Vec2> flattened(const PointSet& set, const Frame& frame, std::size_t i, std::size_t j) {
  if (set.normal(j).dot(frame.w) < kSameSheet) return std::nullopt;
  const Vec3 d = set.position(j) - set.position(i);
  const Vec2 flat(d.dot(frame.u), d.dot(frame.v));
  const double length = flat.norm();
  if (!(length > 0.3 * d.norm())) return std::nullopt;
  return flat * (d.norm() / length);
}

void tangent_cell(const PointSet& set, std::size_t i, std::span<const points::Neighbour> near, double look,
                  std::vector<Vec2>& cell) {
  const Frame frame = frame_about(set.normal(i));
  thread_local std::vector<Vec2> scratch;
  cell.clear();
  for (const auto& [x, y] : {std::pair(-1, -1), std::pair(1, -1), std::pair(1, 1), std::pair(-1, 1)})
    cell.emplace_back(look * x, look * y);
  for (const points::Neighbour& n : near) {
    if (n.index == i || n.squared_distance > look * look) continue;
    if (const auto place = flattened(set, frame, i, n.index)) cut(cell, *place, scratch);
  }
}

}  // namespace meniscus::pointset
