#include <meniscus/sample/surface_points.h>

#include <cmath>

namespace meniscus::sample {

void SurfacePoints::push_back(const Vec3& position, const Vec3& normal) {
  resize(size() + 1);
  set_position(size() - 1, position);
  set_normal(size() - 1, normal);
}

void SurfacePoints::set_position(std::size_t i, const Vec3& p) {
  x[i] = p.x();
  y[i] = p.y();
  z[i] = p.z();
}

void SurfacePoints::set_normal(std::size_t i, const Vec3& n) {
  nx[i] = n.x();
  ny[i] = n.y();
  nz[i] = n.z();
}

void SurfacePoints::resize(std::size_t size) {
  for (auto* a : {&x, &y, &z, &nx, &ny, &nz}) a->resize(size);
}

SurfacePoints SurfacePoints::gathered(std::span<const std::uint32_t> order) const {
  return {sample::gathered(x, order),  sample::gathered(y, order),  sample::gathered(z, order),
          sample::gathered(nx, order), sample::gathered(ny, order), sample::gathered(nz, order)};
}

double hexagonal_spacing(double area, double n) { return std::sqrt(2 * area / (std::sqrt(3.0) * n)); }

}  // namespace meniscus::sample
