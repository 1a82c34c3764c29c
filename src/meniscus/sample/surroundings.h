#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/sample/neighbour_grid.h>
#include <meniscus/sample/surface_points.h>

#include <span>
#include <vector>

namespace meniscus::sample {

/// Neighbour lists that serve one stage after another while the points hardly move. Meant for one set of points: others that
/// take their places have to start with other Surroundings.
class Surroundings {
 public:
  /// Lists as cells need them.
  Surroundings() = default;
  /// Lists within `reach` spacings, until points have moved by `worn` spacings on average. A pair is listed when either
  /// point reaches the other.
  Surroundings(double reach, double worn) : reach_(reach), worn_(worn) {}

  /// Finds the lists anew if the number of points has changed or they have moved that far since. Returns
  /// whether it did.
  bool refresh(const SurfacePoints& points, std::span<const double> spacing, const RunControl& run);
  const Neighbours& lists() const { return lists_; }

 private:
  bool worn(const SurfacePoints& points, std::span<const double> spacing) const;

  double reach_ = 2.5, worn_ = 0.15;
  Neighbours lists_;
  std::vector<double> x_, y_, z_;  // where the points were
};

}  // namespace meniscus::sample
