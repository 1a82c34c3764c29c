#pragma once

#include <meniscus/base/attributes.h>
#include <meniscus/base/box.h>
#include <meniscus/base/vec.h>

#include <vector>

namespace meniscus::mesh {

/// An indexed triangle mesh with named vertex attributes. Triangles are counter-clockwise seen from outside.
struct Mesh {
  std::vector<Vec3> positions;      ///< vertices, world units
  std::vector<Triangle> triangles;  ///< indices into positions
  Attributes attributes;            ///< one element per vertex each
};

/// Smallest box that holds every vertex; empty for no vertices.
Box bounds(const Mesh& mesh);

/// Area, world units squared.
double area(const Mesh& mesh);

/// Signed volume by the divergence theorem, world units cubed; positive for an outward-oriented closed mesh.
double volume(const Mesh& mesh);

/// Area-weighted vertex normals, n of unit length each (zero where no triangle has area).
std::vector<Vec3> vertex_normals(const Mesh& mesh);

}  // namespace meniscus::mesh
