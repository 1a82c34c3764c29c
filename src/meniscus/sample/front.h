#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/run_control.h>
#include <meniscus/field/field.h>
#include <meniscus/sample/density.h>
#include <meniscus/sample/surface_points.h>

#include <cstddef>
#include <vector>

namespace meniscus::sample {

struct FrontOptions {
  double spacing = 0;         ///< wanted distance between neighbours where density is flat, world units, > 0
  double acceptance = 0.8;    ///< a new point is taken when no other is nearer than this many spacings
  std::size_t max_count = 0;  ///< never more points than this
  double tolerance = 0;       ///< distance to the surface that counts as on it, world units
  Density density = {};
  const SurfacePoints* occupied =
      nullptr;  ///< points that stand already: the front grows around them. Not owned; may be null
};

struct Front {
  SurfacePoints points;         ///< those that stood already first
  std::vector<double> spacing;  ///< wanted at each point, world units
  std::size_t seeds = 0;        ///< seeds that were not yet covered when their turn came: at least one per component
  bool capped = false;          ///< stopped at max_count
};

/// A hexagonal tiling that grows over the surface from the seeds, ring by ring: every point offers six neighbours, turned so
/// that one falls on its parent. Seeds already covered are passed over, so each component is reached and none twice.
/// Even to about 20 % at once, with seams where the front meets itself: relax() takes it from there.
/// Deterministic; cost: a few field evaluations per point, once.
Front grow_front(const field::Field& surface, const Box& box, const SurfacePoints& seeds, const FrontOptions& options,
                 const RunControl& run = {});

}  // namespace meniscus::sample
