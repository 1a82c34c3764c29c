#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/run_control.h>
#include <meniscus/field/field.h>
#include <meniscus/points/cloud.h>
#include <meniscus/sample/density.h>
#include <meniscus/sample/evenness.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace meniscus::sample {

/// Attributes of a sampling beside N, pscale (half the spacing: the repulsion radius) and id.
namespace attribute {
inline constexpr std::string_view kArea = "area";                       ///< area element, world units squared
inline constexpr std::string_view kMeanCurvature = "mean_curvature";    ///< (κ₁ + κ₂)/2, positive on a sphere
inline constexpr std::string_view kGaussCurvature = "gauss_curvature";  ///< κ₁ κ₂
}  // namespace attribute

/// How densely and how well a surface is to be sampled. Give `spacing` or `count`, not both.
struct SpreadOptions {
  std::optional<double> spacing = {};  ///< distance between neighbours where density is flat, world units, > 0; halving it
                                       ///< quadruples the count
  std::optional<std::size_t> count = {};  ///< exactly this many points, >= 1
  Density density = {};                   ///< even by default
  bool fast = false;                   ///< preview: the grown start and two dozen steps; packing about 0.83 instead of 0.90
  int steps = 24;                      ///< relaxation steps of the main stage; more heals more defects, 0 leaves the start
  std::size_t max_count = 20'000'000;  ///< never more points than this, in any stage
  /// Points to begin with, each within 4 spacings of the surface, with N, pscale and id: an earlier moment's sampling,
  /// carried along. They keep their ids while they live, what they leave uncovered is filled, and the result is stored by
  /// id. Not owned; may be null.
  const points::Cloud* start = nullptr;
  std::int64_t next_id = 0;  ///< ids of new points count from here
};

enum class SpreadState {
  Even,           ///< as asked; `faults` says at how many places not as even as elsewhere
  PopulationCap,  ///< stopped at max_count: the surface is not fully covered
  CountMissed,    ///< the surface did not take (or leave room for) exactly `count` points
  NoSurface,      ///< F does not change sign in the box
};
std::string_view to_string(SpreadState state);

struct SpreadReport {
  SpreadState state = SpreadState::NoSurface;
  int steps = 0;       ///< relaxation steps made
  double spacing = 0;  ///< hexagonal spacing of the result where density is flat, world units
  Evenness evenness;
  std::size_t quarantined = 0;  ///< points dropped because ∇F vanished there or they could not be put on the surface
  std::size_t faults = 0;       ///< particles that mending left beside a close pair or an empty circle (MendOptions)
  std::size_t born = 0;         ///< points that are not of `start`
  std::size_t died = 0;         ///< points of `start` that are gone
  std::size_t not_finite = 0;   ///< places of the search for components where F was not finite
  std::size_t unresolved = 0;   ///< cells of that search that may hide something smaller than they are
};

struct Sampling {
  points::Cloud cloud;
  SpreadReport report;
};

/// Spreads points evenly over the zero set of `surface` inside `box`: components are searched, a hexagonal front grows over
/// each, descent on a repulsion energy evens it out, points are added and removed to reach the count, the closest pairs are
/// pushed apart, and the places that are still wrong are mended one by one. The control's seed turns the first tile of each
/// component and keys the mending.
///
/// Guarantees: every point satisfies |F| <= 1e-9 · |∇F| · box diameter; every component larger than 1/64 of the box (smaller
/// ones where Field::range is tight) has at least one point; never more than max_count points; same bits for any thread
/// count; the same points up to scale when everything is scaled.
/// Points on faces of the box stay there. Attributes: N, pscale, id, area, mean_curvature, gauss_curvature.
/// Cost: linear in the number of points, about 75 field evaluations a point. Progress and cancellation per block of work.
/// Throws InvalidInput unless exactly one of spacing and count is given and positive, and the box is finite and not empty.
Sampling spread(const field::Field& surface, const Box& box, const SpreadOptions& options, const RunControl& run = {});

/// Where the points of a sampling go while the surface moves on by `dt` seconds, to first order: −F_t/|∇F| along the normal,
/// and with the material along the surface. Positions alone change; spread() with `start` takes it from there.
points::Cloud carried(const field::Field& surface, points::Cloud cloud, double dt, const RunControl& run = {});

/// A cloud with all attributes of a sampling from points and the spacing at each. Points are numbered 0, 1, … unless ids are
/// given.
points::Cloud make_cloud(const field::Field& surface, const Box& box, const SurfacePoints& points,
                         const std::vector<double>& spacing, const std::vector<std::int64_t>& ids,
                         const RunControl& run = {});
points::Cloud make_cloud(const field::Field& surface, const SurfacePoints& points, const std::vector<double>& spacing,
                         const std::vector<std::int64_t>& ids, std::span<const CellMeasure> cells,
                         const RunControl& run = {});

}  // namespace meniscus::sample
