#pragma once

#include <meniscus/mesh/mesh.h>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace meniscus::mesh {

/// A closed walk along the boundary of a mesh, vertex by vertex, with the surface on the left seen from outside.
using Loop = std::vector<std::int32_t>;

/// Takes triangles away until no vertex lies on the boundary twice: two loops that touch cannot be told apart. Keeps the
/// order of the others. Returns the numbers, rising, of the triangles that are left.
std::vector<std::int32_t> part_touching_loops(Mesh& mesh);

/// The loops of a mesh whose boundary touches itself nowhere, each from its lowest vertex on, by that vertex. Linear cost.
std::vector<Loop> boundary_loops(const Mesh& mesh);

/// The strip of triangles that joins two loops: of all strips that hold the shortest edge between them, the one whose
/// squared edges add up to least, triangles that face against `normals` (one unit vector a vertex of `mesh`) counting
/// a hundredfold. The loops run in opposite directions, as those of a hole and of a smaller patch in it do.
/// Nothing if a loop has fewer than three vertices, or the loops are too long (time and memory: the product of lengths, at
/// most 10⁸).
std::optional<std::vector<Triangle>> strip_between(const Mesh& mesh, std::span<const Vec3> normals, const Loop& one,
                                                   const Loop& other);

}  // namespace meniscus::mesh
