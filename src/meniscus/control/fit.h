#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/control/rows.h>

#include <optional>
#include <string>
#include <vector>

namespace meniscus::control {

struct FitOptions {
  std::optional<double> length;  ///< scale of the shape, world units; the diameter of the points if not given
  double tolerance = 1e-10;      ///< done when the RMS distance is below, in lengths
  double least_progress = 1e-5;  ///< done when ten steps lower the RMS distance by less than this share
  int most_steps = 200;
  std::vector<std::string> freeze;  ///< unknowns that stay, by name or by the name of what they belong to
};

struct FitReport {
  bool converged = false;       ///< stopped because it was done, not because of most_steps
  double rms = 0, largest = 0;  ///< distance of the points from the surface to first order, world units
  double rms_before = 0;
  std::vector<double> residual;  ///< signed, per point
  std::size_t parameters = 0;
  int steps = 0;
};

/// Changes the unknowns so that the surface passes through `points` as well as possible: Levenberg–Marquardt on the signed
/// distances F/|∇F|, with the rows and the metric of control points. The surface starts at its present pose and ends at the
/// best one seen. Cost per step: points × the unknowns that reach each, and a dense or sparse factor.
/// Throws InvalidInput for points that are not finite; Cancelled with the best pose so far set.
FitReport fit(field::Field& surface, const std::vector<Vec3>& points, const FitOptions& options = {}, RunControl run = {});

}  // namespace meniscus::control
