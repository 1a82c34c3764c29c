#include <meniscus/pointset/neighbourhood.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace meniscus::pointset {
namespace {

constexpr double kSafe = 0.9;         // of the largest empty ball
constexpr double kOneSided = 0.35;    // |mean offset| of neighbours over their mean distance: a straight border has 0.64
constexpr double kWidestGap = 2.4;    // radians; a straight border has π
constexpr double kSteep = 0.5;        // neighbours farther from the tangent plane than this share of their distance …
constexpr double kSteepShare = 0.15;  // … that so many of them show a crease, not a border
constexpr std::size_t kFewest = 5;    // neighbours for a verdict

}  // namespace

SafeOffsets safe_offsets(const PointSet& set, std::size_t i, std::span<const std::uint32_t> neighbours, double longest) {
  SafeOffsets d{longest, longest};
  const Vec3 p = set.position(i), n = set.normal(i);
  for (const std::uint32_t j : neighbours) {
    const Vec3 e = set.position(j) - p;
    const double height = e.dot(n);
    if (height == 0) continue;
    const double radius = kSafe * e.squaredNorm() / (2 * std::abs(height));
    (height > 0 ? d.outer : d.inner) = std::min(height > 0 ? d.outer : d.inner, radius);
  }
  return d;
}

Vec3 border_at(const PointSet& set, std::size_t i, std::span<const std::uint32_t> neighbours) {
  if (neighbours.size() < kFewest) return Vec3::Zero();
  const Vec3 p = set.position(i);
  const Frame frame = frame_about(set.normal(i));
  Vec2 sum = Vec2::Zero();
  double length = 0, farthest = 0;
  std::size_t steep = 0;
  for (const std::uint32_t j : neighbours) {
    const Vec3 e = set.position(j) - p;
    const Vec2 t(e.dot(frame.u), e.dot(frame.v));
    sum += t;
    length += t.norm();
    farthest = std::max(farthest, e.norm());
    steep += std::abs(e.dot(frame.w)) > kSteep * e.norm() ? 1 : 0;
  }
  const auto count = static_cast<double>(neighbours.size());
  if (!(sum.norm() > kOneSided * length) || static_cast<double>(steep) > kSteepShare * count) return Vec3::Zero();

  std::vector<double> angles;
  angles.reserve(neighbours.size() + 1);
  for (const std::uint32_t j : neighbours) {
    const Vec3 e = set.position(j) - p;
    angles.push_back(std::atan2(e.dot(frame.v), e.dot(frame.u)));
  }
  std::sort(angles.begin(), angles.end());
  angles.push_back(angles.front() + 2 * std::numbers::pi);
  double gap = 0, middle = 0;
  for (std::size_t k = 0; k + 1 < angles.size(); ++k)
    if (angles[k + 1] - angles[k] > gap) {
      gap = angles[k + 1] - angles[k];
      middle = 0.5 * (angles[k] + angles[k + 1]);
    }
  if (gap < kWidestGap) return Vec3::Zero();
  // The neighbours share the sector that the gap leaves of the disc.
  const double spacing = farthest * std::sqrt(std::max(0.0, std::numbers::pi - 0.5 * gap) / count);
  return 0.5 * spacing * (std::cos(middle) * frame.u + std::sin(middle) * frame.v);
}

}  // namespace meniscus::pointset
