#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/field/grid.h>
#include <meniscus/mesh/mesh.h>

#include <cstdint>

namespace meniscus::band {

struct MeshToGridOptions {
  double voxel = 0;       ///< size, world units > 0; details below about one voxel are lost, cost grows as voxel⁻²
  double half_width = 5;  ///< voxels of distance on each side, 2 to 100; 5 serves second derivatives, 3 meshing
  std::uint64_t max_bytes = std::uint64_t{4} << 30;  ///< refuse when the estimate exceeds this
};

/// Bytes that mesh_to_grid is likely to need at its peak, from the area and the longest edge.
double estimated_bytes(const mesh::Mesh& mesh, const MeshToGridOptions& options);

/// Signed distance to a closed mesh in a narrow band, clamped at ±half_width voxels outside it; samples lie on multiples of
/// the voxel size. As a field: field::GridField over the result.
///
/// The sign is that of the outermost closed sheet, whichever way triangles run; self-intersections are tolerated; what is
/// thinner than about a voxel vanishes. Distances are exact but for rounding to float. Same bits for any thread count.
/// Cost: one to three microseconds a sample of the band, most of them in finding exact distances.
/// Throws InvalidInput for an empty mesh, an open one (naming the number of open edges), vertices that are not finite,
/// triangles without their vertices, an option out of range, or when nothing of the inside is left at this voxel size;
/// ResourceLimit with the estimate when memory would not suffice; Cancelled.
field::Grid mesh_to_grid(const mesh::Mesh& mesh, const MeshToGridOptions& options, const RunControl& run = {});

}  // namespace meniscus::band
