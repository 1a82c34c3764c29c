#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/run_control.h>
#include <meniscus/field/field.h>
#include <meniscus/points/cloud.h>

namespace meniscus::sample {

/// A number with an estimate of its own error (same unit, one-sided).
struct Estimate {
  double value = 0;
  double error = 0;
};

struct SurfaceIntegrals {
  Estimate area;         ///< world units squared
  Estimate volume;       ///< enclosed, world units cubed; meaningful only for a surface that closes inside the box
  Estimate total_gauss;  ///< ∫K dA; 2π times the Euler characteristic for a closed surface
};

/// Area, enclosed volume and total Gauss curvature from the area elements of a sampling (spread() or Floaters::cloud():
/// needs N, area, mean_curvature and gauss_curvature). Area elements live in tangent planes; what they miss is known to
/// second order in spacing times curvature, corrected, and a quarter of the correction, with the scatter of elements that do
/// not quite tile, is given as the error. About 0.01 % for 1,000 even points on a sphere. Throws InvalidInput if an
/// attribute is missing.
SurfaceIntegrals integrate(const points::Cloud& sampling);

}  // namespace meniscus::sample
