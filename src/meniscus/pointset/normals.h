#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/points/cloud.h>

#include <cstddef>

namespace meniscus::pointset {

/// How points get normals and which points are left out.
struct NormalOptions {
  /// Size of the largest neighbourhood of which a plane is taken, >= 3; a quarter and a half of it are tried too. Larger
  /// withstands more noise and rounds finer detail.
  int neighbours = 32;
  bool use_given = true;  ///< keep the directions of attribute N where they are usable; otherwise all are estimated
  /// A point is an outlier when it is more than this many times as far from its neighbours as one of them is from its own
  /// (or than twice the median of all) and lies on no sheet with them; above 1. Infinity keeps all.
  double outlier_ratio = 3;
};

/// What was found; the first four groups were left out of the result.
struct NormalReport {
  std::size_t not_finite = 0;    ///< points with a coordinate that is not finite or beyond 1e100
  std::size_t coincident = 0;    ///< points at the place of an earlier one
  std::size_t outliers = 0;      ///< points far from all others
  std::size_t undetermined = 0;  ///< points without a normal whose neighbours lie on a line

  std::size_t given = 0;         ///< normals taken from attribute N
  std::size_t zero_normals = 0;  ///< normals in N that were zero or not finite: estimated instead
  std::size_t estimated = 0;
  std::size_t pieces = 0;  ///< connected pieces that were oriented outwards, each by its own outermost points
  /// Normals that disagree with those of the neighbours, given ones included: orientation failed there.
  std::size_t failed = 0;
};

/// The points that can carry a surface, in their order and with all attributes, each with a unit outward normal in N.
///
/// A missing direction is the one in which a neighbourhood is thinnest, of three sizes the one that is thinnest relative to
/// its width: small where sheets are near one another or the surface bends, large where there is noise. Signs follow from a
/// minimum spanning tree over the neighbours, in which edges through the body come last. Pieces that hold given normals
/// follow those; others face away from their own outermost points, so the inner wall of a hollow body has to be given.
/// Deterministic for any number of threads; independent of scale and place.
///
/// Throws InvalidInput for options without meaning, or when no point is left. Cost: O(n log n), about 300 bytes a point.
/// [Hoppe et al. 1992]
points::Cloud with_normals(const points::Cloud& cloud, const NormalOptions& options = {}, NormalReport* report = nullptr,
                           const RunControl& run = {});

}  // namespace meniscus::pointset
