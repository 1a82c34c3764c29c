#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/run_control.h>
#include <meniscus/field/field.h>
#include <meniscus/sample/density.h>
#include <meniscus/sample/surface_points.h>
#include <meniscus/sample/surroundings.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace meniscus::sample {

/// A population under arrangement: points, the spacing wanted at each, and what it needs to keep them so.
struct Population {
  SurfacePoints points;
  std::vector<double> spacing;        ///< world units; scaled so that n hexagonal cells of these spacings tile the area
  std::vector<std::int64_t> id = {};  ///< of each point (kNewcomer for those that came since), or none at all
  Surroundings near = {};             ///< of the points; begun anew whenever others take their places

  static constexpr std::int64_t kNewcomer = std::numeric_limits<std::int64_t>::max();
  void push_back(const Vec3& position, const Vec3& normal, double wanted);
  /// The points `order`, in that order.
  Population gathered(std::span<const std::uint32_t> order) const;
};

/// Scales all spacings by one factor so that Σ (√3/2) spacing² equals the area of the cells: what n points can have.
void fit_spacing(Population& population, const Box& box, const RunControl& run = {});

/// How many points the area holds at `spacing` (and density): Σ area_i / (√3/2 spacing_i²), rounded. Before fit_spacing.
std::size_t hexagonal_count(Population& population, const Box& box, const RunControl& run = {});

/// Brings the population to exactly `count` points: inserts in the largest empty circles, removes the points with the
/// smallest cells, spread out, a few relaxation steps between rounds and none after the last. Returns whether it got there
/// (a surface too small for the count in `rounds` rounds is a result, not an error). Deterministic.
bool reach_count(const field::Field& surface, const Box& box, const Density& density, std::size_t count, int rounds,
                 Population& population, const RunControl& run = {});

/// Puts a point into every empty circle larger than `largest` times that of the hexagonal lattice, while there are fewer
/// than `max_count`. Returns how many.
std::size_t fill_holes(const field::Field& surface, const Box& box, double largest, std::size_t max_count,
                       Population& population, const RunControl& run = {});

/// Puts all points on the surface to `tolerance` (world units) and drops those that cannot be put there, and those that come
/// down within a twentieth of a spacing of another with a normal to the same side. Returns how many it dropped.
std::size_t land(const field::Field& surface, const Box& box, double tolerance, Population& population,
                 const RunControl& run = {});

/// Stores the population in spatial order, so that neighbours are near in memory.
void sort_spatially(Population& population);

}  // namespace meniscus::sample
