#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/run_control.h>
#include <meniscus/field/field.h>
#include <meniscus/sample/surface_points.h>
#include <meniscus/sample/surroundings.h>

#include <cstdint>
#include <span>

namespace meniscus::sample {

/// A run of descent steps on the repulsion energy Σ w(|x_i − x_j| / d_ij), d_ij the mean of the two wanted spacings.
struct RelaxOptions {
  enum class Kernel {
    Smooth,   ///< (1 − r/h)⁴: evens out density, heals defects; long reach
    Contact,  ///< (1 − r/h)²: touches only pairs closer than h; lifts the smallest distance and leaves the rest alone
  };
  Kernel kernel = Kernel::Smooth;
  double reach = 2;  ///< h in spacings
  int steps = 60;
  double momentum = 0.9;  ///< share of the last displacement carried on, in [0, 1)
  double step = 0.7;      ///< fraction of a Newton step (force over curvature of the energy) taken per particle
};

/// Moves `points` (wanted distance to neighbours: `spacing`, world units) along `surface` within `box` to lower energy.
///
/// Every particle has its own step length from the second derivatives of the energy at its place, so sparse and dense
/// regions settle alike; none moves farther than 0.2 spacings in a step. Each step evaluates the field once and takes one
/// Newton step towards the surface; points end near the surface, project() puts them on it. Same bits for any thread count.
/// Memory is touched locally if the points are in spatial_order(). Cost: O(n) per step.
/// With `movable` (one per point) only points marked 1 move; the others are there to be kept away from. Neighbours are taken
/// from `near` where it is given, and kept fresh there.
void relax(const field::Field& surface, const Box& box, SurfacePoints& points, std::span<const double> spacing,
           const RelaxOptions& options, const RunControl& run = {}, std::span<const std::uint8_t> movable = {},
           Surroundings* near = nullptr);

}  // namespace meniscus::sample
