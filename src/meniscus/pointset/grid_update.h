#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/pointset/point_set.h>
#include <meniscus/pointset/sculpt_grid.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace meniscus::pointset {

/// The points whose domains lie inside a box, in rising order.
std::vector<std::uint32_t> points_inside(const PointSet& set, const Box& box);

/// What an update did to the points it was given.
struct GridUpdate {
  std::size_t moved = 0;
  std::size_t lost = 0;  ///< the surface left their domain: position, normal and function stay as they were
  double farthest = 0;   ///< largest motion, world units
};

/// Lets points follow values that have just made a step of `seconds`: each samples values and rates at its local grid from
/// the eight corners of the enclosing voxels, gets the coefficients p, ṗ from them by the constant inverse, moves by
/// ẋ·n = −(∇_p s·ṗ)/|∇_x s|, then by Newton's method on its own s (4.3), and takes the samples of its new place.
/// A point moves at most half its reach. Points around which nothing moves keep every bit. `touched` are points whose
/// domains lie inside the grid, each once. Deterministic for any number of threads. [GHQ03; THEORY §6, Dynamics]
GridUpdate follow_grid(PointSet& set, std::span<const std::uint32_t> touched, const SculptGrid& grid, double seconds,
                       const RunControl& run = {});

}  // namespace meniscus::pointset
