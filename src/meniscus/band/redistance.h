#pragma once

#include <meniscus/band/band.h>
#include <meniscus/band/outline.h>

namespace meniscus::band {

/// How a redistancing went.
struct RedistanceReport {
  int passes = 0;          ///< of the eikonal iteration
  double last_change = 0;  ///< of the last pass, in voxels
};

/// Makes the samples signed distances again (|∇φ| = 1) without moving the surface: nodes next to it are divided by a
/// smoothed |∇φ|, so that crossings stay where they are to well below a hundredth of a voxel; the others follow from them
/// by the eikonal equation, second order. Does not wake or drop bricks. Ends when a pass changes less than a ten-thousandth
/// of a voxel, or after `max_passes` over the bricks: two suffice for samples that are nearly distances already.
RedistanceReport redistance(Band& band, const RunControl& run = {}, int max_passes = 16);
/// The same with room for the samples that the caller keeps.
RedistanceReport redistance(Band& band, int max_passes, std::vector<float>& room, const RunControl& run);

/// The first half of it: nodes next to the surface are divided by a smoothed |∇φ|. `outlines` are those of the samples,
/// before and after.
void rescale_distances(Band& band, Outlines& outlines, std::vector<float>& room, const RunControl& run);
/// One pass of the second half, outwards from the nodes next to the surface through rows that came within `reach` voxels of
/// it: what a step that has moved but those leaves to do. Returns the largest change, world units.
float spread_distances(Band& band, Outlines& outlines, double reach, std::vector<float>& room, const RunControl& run);

}  // namespace meniscus::band
