#pragma once

#include <meniscus/field/field.h>

#include <memory>

namespace meniscus::field {

// Distance primitives. Lengths and coordinates are world units. F is the signed distance except for the ellipsoid, where it
// only shares the surface and the sign. Each throws InvalidInput for numbers that are not finite, negative sizes and radii,
// or a zero axis or normal.

/// Unknowns: center, radius.
std::unique_ptr<Field> sphere(const Number3& center, const Number& radius);
/// Axis-aligned; `size` are the full edge lengths. Unknowns: center, size.
std::unique_ptr<Field> box(const Number3& center, const Number3& size);
/// `axis` need not be of unit length; `major` is the radius of the ring, `minor` that of the tube.
std::unique_ptr<Field> torus(const Number3& center, const Number3& axis, const Number& major, const Number& minor);
/// All points nearer than `radius` to the segment a b.
std::unique_ptr<Field> capsule(const Number3& a, const Number3& b, const Number& radius);
/// The half-space behind `point`; `normal` points out and need not be of unit length.
std::unique_ptr<Field> plane(const Number3& point, const Number3& normal);
/// F = (|p/radii| − 1) · (harmonic mean of the radii): zero on the ellipsoid, |∇F| between hm/max and hm/min of the radii.
std::unique_ptr<Field> ellipsoid(const Number3& center, const Number3& radii);

}  // namespace meniscus::field
