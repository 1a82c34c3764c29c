#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/points/cloud.h>
#include <meniscus/points/neighbours.h>
#include <meniscus/pointset/point_set.h>

#include <cstddef>
#include <cstdint>
#include <span>

namespace meniscus::pointset {

/// How local functions are fitted.
struct FitOptions {
  /// Points each domain holds beside its own, >= 1: more is smoother and slower. Fewer are taken when there are fewer.
  std::size_t neighbours = 20;
  int grid = 3;  ///< control points along an axis of a local grid, 3 … kMostGrid; above 3 is far slower
  enum class Rows {
    Offset,    ///< value 0 at neighbours, ±d at two points off the surface on each normal [GHQ03]
    Gradient,  ///< value 0 and gradient = normal at neighbours: closest to the normals, sheets may appear off the surface
    Both,      ///< values and gradients at all of these points
  };
  Rows rows = Rows::Both;
  /// Weight of bending (integral of squared second derivatives) against the data, >= 0. Larger forgets noise and detail.
  double smoothing = 1e-5;
  /// Leaves out points whose neighbours are this many times farther than those of the points near them; 0 keeps all.
  double outlier_ratio = 4;
};

/// What became of the cloud's points.
struct FitReport {
  std::size_t points = 0;          ///< of the cloud
  std::size_t domains = 0;         ///< of the result
  std::size_t not_finite = 0;      ///< left out: a coordinate is NaN or infinite
  std::size_t without_normal = 0;  ///< left out: the normal is zero or not finite
  std::size_t coincident = 0;      ///< left out: at the place of an earlier point
  std::size_t outliers = 0;        ///< left out: see FitOptions::outlier_ratio
  std::size_t border = 0;          ///< kept, at an open border
};

/// Fits a point-set surface to points with normals (attribute "N", any length but zero).
///
/// Each point's function is its tangent plane plus a B-spline fitted by weighted least squares to what the plane leaves
/// over, with a little bending energy, so that it can always be solved and is the plane where no data speak. Off-surface
/// points p ± d n are kept so near that no other point is nearer to them than p. Coordinates may be large: all is done about
/// p_i.
///
/// Deterministic for any number of threads; the result scales with the cloud. Cost: O(n log n); 5 µs a point on one core.
/// Throws InvalidInput for options without meaning, a cloud without normals, and when fewer than two points are left.
/// [GHQ03 §4; THEORY §6]
PointSet fit(const points::Cloud& cloud, const FitOptions& options = {}, FitReport* report = nullptr, RunControl run = {});

/// Fits the functions of the points `touched` anew to where the points of the set are now; their reach and border with them.
/// `search` knows the set's positions, in order.
void refit(PointSet& set, std::span<const std::size_t> touched, const points::NeighbourSearch& search,
           const FitOptions& options = {}, RunControl run = {});

/// Positions of a set, for a NeighbourSearch.
std::vector<Vec3> positions(const PointSet& set);

}  // namespace meniscus::pointset
