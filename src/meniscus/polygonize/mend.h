#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/run_control.h>
#include <meniscus/mesh/mesh.h>

#include <cstdint>
#include <span>
#include <vector>

namespace meniscus::polygonize {

/// A mesh put together from an old and a fresh one: what was kept of the old comes first, in the old order.
struct Mended {
  mesh::Mesh mesh;                           ///< without attributes
  std::vector<std::int32_t> kept_vertices;   ///< numbers in the old mesh, rising
  std::vector<std::int32_t> kept_triangles;  ///< the same
  std::vector<Box> regions;                  ///< what was replaced, one box per place that hangs together
  bool whole = false;                        ///< nothing could be kept: the mesh is the fresh one
};

/// In voxels: meshes that are farther apart are not the same surface.
inline constexpr double kMendDistance = 0.5;

/// Replaces by `fresh` the places where `old`, which once was the same surface, no longer is: where one of the two is
/// farther than kMendDistance from the other, where triangles are turned over or stand askew (over 75° to the attribute N),
/// and about the vertices flagged in `lost` (one entry a vertex, or empty). These are cut out with `2` voxels around, the
/// fresh surface is put in and joined by strips of triangles. Where that does not give a closed, oriented manifold without
/// triangles turned over and with the components and handles of `fresh`, more is cut out, up to 8 voxels around; failing
/// that the fresh mesh is taken whole.
///
/// Both meshes are closed manifolds with the attribute N; the vertices of `old` that are not lost lie on the surface.
/// Same bits for any number of threads; cost about that of meshing.
Mended mend(const mesh::Mesh& old, std::span<const std::uint8_t> lost, const mesh::Mesh& fresh, double voxel,
            const RunControl& run = {});

}  // namespace meniscus::polygonize
