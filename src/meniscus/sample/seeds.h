#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/run_control.h>
#include <meniscus/field/field.h>
#include <meniscus/sample/surface_points.h>

#include <cstddef>

namespace meniscus::sample {

struct SeedOptions {
  double resolution = 0;            ///< cell size at which the surface is looked for, world units, > 0
  int refinements = 3;              ///< halvings below that for cells that may hold a surface but show no change of sign
  std::size_t max_cells = 400'000;  ///< limit of one level of the search; a level above it is not refined any further
  double tolerance = 0;             ///< distance to the surface that counts as on it, world units
};

struct Seeds {
  SurfacePoints points;        ///< about one per cell that the surface crosses
  std::size_t not_finite = 0;  ///< sampled places where F was NaN or infinite
  std::size_t unresolved = 0;  ///< cells left that might hold something smaller than the finest cell
};

/// Points on every part of the surface inside `box`: sparse top-down subdivision where Field::range bounds F away from zero,
/// sign sampling in the cells that remain. A component larger than a cell is always hit; a smaller one when `range` is tight
/// enough to follow it. The points are dense enough (one per crossed cell) to tell components apart by what stays uncovered.
/// Deterministic. Cost: cells the surface crosses, plus what loose bounds add.
Seeds find_seeds(const field::Field& surface, const Box& box, const SeedOptions& options, const RunControl& run = {});

}  // namespace meniscus::sample
