#include <meniscus/sample/surroundings.h>

#include <cmath>

namespace meniscus::sample {
namespace {

constexpr std::size_t kStride = 4;  // every fourth point speaks for all

}  // namespace

bool Surroundings::refresh(const SurfacePoints& points, std::span<const double> spacing, const RunControl& run) {
  if (!worn(points, spacing)) return false;
  std::vector<double> reach(spacing.begin(), spacing.end());
  for (double& r : reach) r *= reach_;
  lists_ = find_neighbours(points.positions(), reach, run);
  x_ = points.x;
  y_ = points.y;
  z_ = points.z;
  return true;
}

bool Surroundings::worn(const SurfacePoints& points, std::span<const double> spacing) const {
  if (points.size() != lists_.size()) return true;
  double moved = 0;
  for (std::size_t i = 0; i < points.size(); i += kStride)
    moved += (points.position(i) - Vec3(x_[i], y_[i], z_[i])).norm() / spacing[i];
  return moved * kStride > worn_ * static_cast<double>(points.size());
}

}  // namespace meniscus::sample
