#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/pointset/point_set_field.h>
#include <meniscus/pointset/sculpt_grid.h>
#include <meniscus/pointset/stroke.h>

#include <cstdint>
#include <vector>

namespace meniscus::pointset {

/// The voxels that a force acts on: a sculpting grid about the tool, loaded by −(f·∇s) with the tool's profile and set to
/// the values of a point-set field. Far voxels, which no domain sees, are left at 0.
class ForceRegion {
 public:
  /// A region around the tool, half a radius wider, and its load scaled so that in `seconds` of `steps` values change by
  /// stroke.strength at most.
  ForceRegion(const PointSetField& field, const Stroke& stroke, const ToolShape& shape, int steps, const RunControl& run);

  SculptGrid& grid() { return grid_; }
  /// Sets d⁰ so that d agrees with the field as it is now, whatever the deviation; and the load with the field's slope.
  void sample(const PointSetField& field, const RunControl& run);
  /// Largest change of values since `since` (deviations) at the points.
  double largest_change(const PointSet& set, const std::vector<std::uint32_t>& points, std::span<const float> since) const;

 private:
  void load(double factor);

  const Stroke stroke_;
  SculptGrid grid_;
  std::vector<float> profile_;  // 0 … 1, by voxel
  std::vector<char> near_;      // voxels within sight of a point
  double factor_ = 1;
};

}  // namespace meniscus::pointset
