#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/mesh/mesh.h>
#include <meniscus/polygonize/clipped_field.h>

namespace meniscus::polygonize {

/// Takes away the triangles of a mesh of F = 0 that have a corner where F is not small: there the sign changes by a jump.
/// Vertices that no triangle uses any more go with them. Returns how many triangles went.
std::size_t drop_jumps(const ClippedField& field, double voxel, mesh::Mesh& mesh, const RunControl& run);

}  // namespace meniscus::polygonize
