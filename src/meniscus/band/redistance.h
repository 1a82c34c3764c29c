#pragma once

#include <meniscus/band/band.h>

namespace meniscus::band {

/// How a redistancing went.
struct RedistanceReport {
  int passes = 0;          ///< of the eikonal iteration
  double last_change = 0;  ///< of the last pass, in voxels
};

/// Makes the samples signed distances again (|∇φ| = 1) without moving the surface: nodes next to it are divided by a
/// smoothed |∇φ|, so that crossings stay where they are to well below a hundredth of a voxel; the others follow from them
/// by the eikonal equation, second order. Does not wake or drop bricks. Cost: about ten passes over the bricks.
RedistanceReport redistance(Band& band, const RunControl& run = {});

}  // namespace meniscus::band
