#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/field/field.h>
#include <meniscus/sample/surface_points.h>

#include <optional>
#include <vector>

namespace meniscus::sample {

/// Points crowd towards a place.
struct Focus {
  Vec3 point = Vec3::Zero();
  double radius = 0;     ///< distance at which the effect has fallen to half, world units, > 0
  double factor = 0.25;  ///< relative spacing at the point itself, in (0, 1]
};

/// Where points should lie closer together. All parts multiply; the default is even everywhere.
struct Density {
  /// C >= 0: spacing is divided by √(1 + (C κ S)²), κ = √(κ₁² + κ₂²), S the spacing of flat parts: about 1/(C κ) where the
  /// surface bends much. 0 ignores curvature; 2 keeps neighbours within about half a radian of turn.
  double curvature = 0;
  std::optional<Focus> focus = {};
  /// Spacing is multiplied by this field's value there (clamped to [finest, 1]). Not owned; may be null.
  const field::Field* factor = nullptr;
  double finest = 0.2;  ///< smallest relative spacing, in (0, 1]

  bool uniform() const { return curvature == 0 && !focus && factor == nullptr; }
};

/// Throws InvalidInput for numbers out of their range.
void check(const Density& density);

/// Wanted spacing at every point, between density.finest · spacing and spacing.
std::vector<double> wanted_spacing(const field::Field& surface, const Density& density, double spacing,
                                   const SurfacePoints& points, const RunControl& run = {});

/// Curvature at a point from F's derivatives, outward normal, positive on a sphere.
struct Curvature {
  double mean = 0;   ///< (κ₁ + κ₂) / 2, 1/length
  double gauss = 0;  ///< κ₁ κ₂, 1/length²
};
Curvature curvature(const Vec3& gradient, const Mat3& hessian);
std::vector<Curvature> curvatures(const field::Field& surface, const SurfacePoints& points, const RunControl& run = {});

}  // namespace meniscus::sample
