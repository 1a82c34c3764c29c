#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/pointset/point_set.h>

namespace meniscus::pointset {

/// How well a point-set surface keeps to its own points.
struct FitQuality {
  double mean_value = 0;         ///< mean |s| at the points, world units
  double max_value = 0;          ///< largest |s| at the points
  double mean_normal_error = 0;  ///< mean angle between ∇s and the points' normals, degrees
};

/// Evaluates the set's field at its points. All zero for an empty set.
FitQuality fit_quality(const PointSet& set, const RunControl& run = {});

}  // namespace meniscus::pointset
