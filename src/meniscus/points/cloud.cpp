#include <meniscus/points/cloud.h>

namespace meniscus::points {

Box bounds(const Cloud& cloud) {
  Box box;
  for (const Vec3& p : cloud.positions) box.extend(p);
  return box;
}

Cloud gathered(const Cloud& cloud, std::span<const std::size_t> indices) {
  Cloud out;
  out.positions.reserve(indices.size());
  for (const std::size_t i : indices) out.positions.push_back(cloud.positions[i]);
  out.attributes = cloud.attributes.gathered(indices);
  return out;
}

}  // namespace meniscus::points
