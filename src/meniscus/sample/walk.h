#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/run_control.h>
#include <meniscus/field/field.h>
#include <meniscus/sample/surface_points.h>

#include <cstdint>
#include <span>
#include <vector>

namespace meniscus::sample {

/// Moves each point along the surface by `offset` (world units, from where it stands; made tangent), in `steps` equal parts:
/// after each the point returns to F = 0 and the direction turns with the tangent plane, so the way is close to a geodesic
/// when a part is short against the radius of curvature. Sets normals. Returns 1 for those that end on the surface to
/// `tolerance` (world units) and inside `box`.
std::vector<std::uint8_t> walk(const field::Field& surface, const Box& box, std::span<const Vec3> offset, int steps,
                               double tolerance, SurfacePoints& points, const RunControl& run = {});

}  // namespace meniscus::sample
