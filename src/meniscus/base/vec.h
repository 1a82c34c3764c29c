#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>

namespace meniscus {

/// The library's vocabulary of small vectors. Right-handed axes, y up, world units.
using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

/// Vertex indices of a triangle, counter-clockwise seen from outside.
using Triangle = std::array<std::int32_t, 3>;

}  // namespace meniscus
