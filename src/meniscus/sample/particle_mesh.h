#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/run_control.h>
#include <meniscus/mesh/mesh.h>
#include <meniscus/points/cloud.h>

#include <cstddef>

namespace meniscus::sample {

/// What the mesh of a sampling lacks, if anything.
struct ParticleMeshReport {
  std::size_t open_edges = 0;    ///< edges with one triangle, those at the faces of the box not counted
  std::size_t border_edges = 0;  ///< edges with one triangle within a spacing of a face of the box: the surface ends there
  std::size_t unused = 0;        ///< particles without a triangle
  std::size_t filled = 0;        ///< triangles that closed gaps where tangent planes disagreed
  bool closed() const { return open_edges == 0 && border_edges == 0; }
};

/// Triangles between the particles of a sampling (needs N and pscale), oriented by the normals: the Delaunay neighbours of
/// every particle in its tangent plane, a triangle where all three corners agree; small gaps where they do not are closed.
/// Vertices are the particles in order, with all their attributes. On an even sampling with spacing below about half the
/// smallest radius of curvature and distance between sheets the mesh is closed and manifold; otherwise the report says what
/// is missing. Always oriented and manifold: no edge has more than two triangles, no vertex more than one fan.
/// Deterministic; O(n). Throws InvalidInput without N or pscale.
mesh::Mesh particle_mesh(const points::Cloud& sampling, const Box& box, ParticleMeshReport* report = nullptr,
                         const RunControl& run = {});

}  // namespace meniscus::sample
