#include <meniscus/field/segment.h>
#include <meniscus/field/shapes.h>

#include <Eigen/Geometry>

namespace meniscus::field {

Vec3 segment_velocity(const double* q, const double* r, const Vec3& x) {
  const Vec3 a(q[0], q[1], q[2]), ab(q[3] - q[0], q[4] - q[1], q[5] - q[2]);
  const Vec3 va(r[0], r[1], r[2]), vab(r[3] - r[0], r[4] - r[1], r[5] - r[2]);
  const Vec3 p = x - a;
  const double t = shapes::segment_parameter(std::array{p.x(), p.y(), p.z()}, std::array{ab.x(), ab.y(), ab.z()});
  const double l2 = ab.squaredNorm();
  const Vec3 omega = l2 > 0 ? Vec3(ab.cross(vab) / l2) : Vec3(Vec3::Zero());
  return va + t * vab + omega.cross(p - t * ab);
}

}  // namespace meniscus::field
