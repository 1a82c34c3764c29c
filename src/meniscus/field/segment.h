#pragma once

#include <meniscus/base/vec.h>

namespace meniscus::field {

/// Velocity of the material of a segment with end points q[0..2], q[3..5] and end velocities r[0..2], r[3..5], at x: that of
/// the nearest axis point, turned with the axis.
Vec3 segment_velocity(const double* q, const double* r, const Vec3& x);

}  // namespace meniscus::field
