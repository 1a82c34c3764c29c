#pragma once

#include <meniscus/band/band.h>

#include <vector>

namespace meniscus::band {

/// One per brick. Whoever changes samples brings the outlines of those bricks up to date.
using Outlines = std::vector<Outline>;

Outlines outlines_of(const Band& band, const RunControl& run = {});
/// Makes the outline of a brick fit samples that it has got.
void update_outline(const Band& band, const float* samples, Outline& out);
/// After Band::adapt().
void remap_outlines(const Band& band, const std::vector<std::int32_t>& map, Outlines& outlines);

/// The rows that hold a node nearer to the surface than `voxels`, and some that come within a sixteenth of a voxel of it.
Rows rows_within(const Outline& outline, double voxels);
/// The same, those next to the surface first.
RowLayers layers_within(const Outline& outline, double voxels);

/// Per brick whether both sides of the surface are found in it and its neighbours.
std::vector<char> surface_bricks(const Band& band, const Outlines& outlines, const RunControl& run);

}  // namespace meniscus::band
