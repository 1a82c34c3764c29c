#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/run_control.h>
#include <meniscus/field/field.h>
#include <meniscus/sample/surface_points.h>

#include <cstdint>
#include <vector>

namespace meniscus::sample {

struct ProjectionOptions {
  double tolerance = 0;     ///< distance |F|/|∇F| that counts as on the surface, world units
  double max_distance = 0;  ///< farther than this from its start a point has lost its sheet and fails, world units
  int iterations = 60;      ///< plain Newton needs 3 to 6; creases of F take more
};

/// Moves points onto F = 0 inside `box` by Newton steps x ← x − F ∇F/|∇F|², and sets their normals. [SS11 (4.3)]
/// A point on a face of the box slides along that face. Returns 1 for every point that arrived; the others (∇F = 0, F not
/// finite, too far) keep their last finite position. Each point's result is independent of the others.
std::vector<std::uint8_t> project(const field::Field& surface, const Box& box, const ProjectionOptions& options,
                                  SurfacePoints& points, const RunControl& run = {});

/// −F ∇F/|∇F|² at p, with the parts of ∇F that leave the box through a face that p lies on removed; zero where ∇F vanishes.
Vec3 newton_step(const Box& box, const Vec3& p, double f, const Vec3& gradient);

}  // namespace meniscus::sample
