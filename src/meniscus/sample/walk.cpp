#include <meniscus/sample/projection.h>
#include <meniscus/sample/walk.h>

#include <algorithm>

namespace meniscus::sample {

std::vector<std::uint8_t> walk(const field::Field& surface, const Box& box, std::span<const Vec3> offset, int steps,
                               double tolerance, SurfacePoints& points, const RunControl& run) {
  std::vector<std::uint8_t> arrived(points.size(), 1);
  std::vector<Vec3> part(offset.begin(), offset.end());
  double longest = tolerance;
  for (Vec3& d : part) {
    d /= steps;
    longest = std::max(longest, d.norm());
  }
  for (int s = 0; s < steps; ++s) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double length = part[i].norm();
      const Vec3 n = points.normal(i), along = part[i] - part[i].dot(n) * n;
      if (!(along.norm() > 0)) continue;
      part[i] = length / along.norm() * along;
      points.set_position(i, points.position(i) + part[i]);
    }
    const std::vector<std::uint8_t> on =
        project(surface, box, {.tolerance = tolerance, .max_distance = 2 * longest, .iterations = 12}, points, run);
    for (std::size_t i = 0; i < on.size(); ++i) arrived[i] &= on[i];
  }
  return arrived;
}

}  // namespace meniscus::sample
