#pragma once

#include <meniscus/points/neighbours.h>
#include <meniscus/pointset/point_set.h>

#include <span>
#include <vector>

namespace meniscus::pointset {

/// Cosine of the angle between normals from which on two near points count as of one sheet.
inline constexpr double kSameSheet = 0.3;

/// Point i's Voronoi cell in its tangent plane: the corners of a convex polygon about the origin, in world units along
/// frame_about(normal).u and .v. `near` are points about it, of which those of its own sheet count, at their distance in
/// space, which bent surfaces shorten on the plane. Where they do not close the cell it ends at the square of half width
/// `look`. Replaces `cell`. [THEORY §6, Resampling]
void tangent_cell(const PointSet& set, std::size_t i, std::span<const points::Neighbour> near, double look,
                  std::vector<Vec2>& cell);

}  // namespace meniscus::pointset
