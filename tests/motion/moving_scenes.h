#pragma once

#include <meniscus/field/blobs.h>
#include <meniscus/field/combine.h>
#include <meniscus/field/primitives.h>
#include <meniscus/field/time_expression.h>
#include <meniscus/field/transform.h>
#include <meniscus/mesh/mesh.h>
#include <meniscus/polygonize/polygonize.h>

#include <Eigen/Geometry>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

namespace meniscus::test {

inline field::Number moving(const std::string& formula) {
  return field::Number::animated(std::make_shared<field::TimeExpression>(formula));
}

inline std::string text(double v) { return std::to_string(v); }

/// Three unlike blobs about the origin.
inline std::unique_ptr<field::Field> three_blobs(double scale = 1) {
  const field::Blob items[] = {{{0.75 * scale, 0.0, 0.0}, 1.3 * scale},
                               {{-0.45 * scale, 0.2 * scale, 0.6 * scale}, 1.1 * scale},
                               {{-0.3 * scale, -0.35 * scale, -0.55 * scale}, 1.2 * scale}};
  return field::blobs(field::BlobKernel::Compact, 0.4, items);
}

/// The same, carried along by (0.7, −0.3, 0.5) · scale per second.
inline std::unique_ptr<field::Field> carried_blobs(double scale = 1) {
  const std::string s = text(scale);
  const field::Blob items[] = {
      {{moving(s + "*(0.75+0.7*t)"), moving(s + "*(-0.3*t)"), moving(s + "*0.5*t")}, 1.3 * scale},
      {{moving(s + "*(-0.45+0.7*t)"), moving(s + "*(0.2-0.3*t)"), moving(s + "*(0.6+0.5*t)")}, 1.1 * scale},
      {{moving(s + "*(-0.3+0.7*t)"), moving(s + "*(-0.35-0.3*t)"), moving(s + "*(-0.55+0.5*t)")}, 1.2 * scale}};
  return field::blobs(field::BlobKernel::Compact, 0.4, items);
}

/// Two blobs that approach and stretch each other.
inline std::unique_ptr<field::Field> approaching_blobs(double scale = 1) {
  const std::string s = text(scale);
  const field::Blob items[] = {{{moving(s + "*(-0.7+0.5*t)"), 0.0, 0.1 * scale}, 1.2 * scale},
                               {{moving(s + "*(0.7-0.5*t)"), moving(s + "*0.2*t"), 0.0}, 1.1 * scale}};
  return field::blobs(field::BlobKernel::Compact, 0.4, items);
}

/// Three blobs whose centres turn about y by one radian a second: rigid as a whole, though no blob turns itself.
inline std::unique_ptr<field::Field> orbiting_blobs() {
  const auto item = [](double x, double y, double z, double r) {
    const std::string a = text(x);
    const std::string b = text(z);
    return field::Blob{{moving(a + "*cos(t)+" + b + "*sin(t)"), y, moving(b + "*cos(t)-" + a + "*sin(t)")}, r};
  };
  const field::Blob items[] = {item(0.75, 0, 0, 1.3), item(-0.45, 0.2, 0.6, 1.1), item(-0.3, -0.35, -0.55, 1.2)};
  return field::blobs(field::BlobKernel::Compact, 0.4, items);
}
inline Vec3 orbit_velocity(const Vec3& x) { return Vec3(0, 1, 0).cross(x); }

inline mesh::Mesh surface(const field::Field& f, double voxel) {
  return polygonize::polygonize(f, {.voxel = voxel, .count_components = false}).mesh;
}

}  // namespace meniscus::test
