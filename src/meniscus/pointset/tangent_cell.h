#pragma once

#include <meniscus/points/neighbours.h>
#include <meniscus/pointset/point_set.h>

#include <optional>
#include <span>
#include <vector>

namespace meniscus::pointset {

/// Cosine of the angle between normals from which on two near points count as of one sheet.
inline constexpr double kSameSheet = 0.3;

/// Where point j lies in point i's tangent plane, at its distance in space, which bent surfaces shorten on the plane; world
/// units along u and v of `frame`, frame_about(normal of i). Nothing for points of another sheet.
std::optional<Vec2> flattened(const PointSet& set, const Frame& frame, std::size_t i, std::size_t j);

/// Point i's Voronoi cell in its tangent plane: the corners of a convex polygon about the origin, in world units along
/// frame_about(normal).u and .v. `near` are points about it, flattened(). Where they do not close the cell it ends at the
/// square of half width `look`. Replaces `cell`. [THEORY §6, Resampling]
void tangent_cell(const PointSet& set, std::size_t i, std::span<const points::Neighbour> near, double look,
                  std::vector<Vec2>& cell);

}  // namespace meniscus::pointset
