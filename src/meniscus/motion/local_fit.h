#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/motion/velocity.h>

namespace meniscus::motion {

/// Replaces the tangential part of every velocity (which comes in as the blended one) by that of the rigid motion that
/// matches the normal speeds of the point and its `count` nearest neighbours best. Neighbours on other sheets (normals more
/// than 90° apart) do not count. Sets the confidence to that of the least determined direction.
void fit_rigid_motions(std::span<const Vec3> points, std::size_t count, Velocities& v, const RunControl& run);

}  // namespace meniscus::motion
