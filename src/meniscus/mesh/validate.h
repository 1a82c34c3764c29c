#pragma once

#include <meniscus/mesh/mesh.h>

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace meniscus::mesh {

/// What is right and wrong with a mesh. Triangles with an index out of range, or with one vertex twice, are counted and
/// otherwise left out of everything below.
struct Audit {
  std::size_t out_of_range_triangles = 0;  ///< with an index that is no vertex
  std::size_t repeated_vertices = 0;       ///< triangles that use one vertex twice
  std::size_t zero_area_triangles = 0;     ///< height below 1e-12 of the longest side
  std::size_t duplicate_triangles = 0;     ///< beyond the first with the same three vertices, either way round
  std::size_t nonfinite_vertices = 0;
  std::size_t unused_vertices = 0;                ///< not used by any triangle
  std::size_t boundary_edges = 0;                 ///< used by one triangle
  std::size_t nonmanifold_edges = 0;              ///< used by more than two
  std::size_t misoriented_edges = 0;              ///< used by two that run the same way
  std::size_t nonmanifold_vertices = 0;           ///< whose triangles are not one fan
  std::vector<std::string> attribute_mismatches;  ///< names of attributes whose size is not the number of vertices
  std::size_t nonfinite_attributes = 0;           ///< attribute values that are not finite

  std::size_t vertices = 0;  ///< used ones
  std::size_t edges = 0;
  std::size_t triangles = 0;
  std::size_t components = 0;
  long long euler = 0;  ///< vertices - edges + triangles

  /// Sum of the components' genus; only where the surface is closed, oriented and manifold.
  std::optional<long long> genus;

  bool closed() const { return boundary_edges == 0; }
  bool manifold() const { return nonmanifold_edges == 0 && nonmanifold_vertices == 0 && duplicate_triangles == 0; }
  bool oriented() const { return misoriented_edges == 0; }
  bool finite() const { return nonfinite_vertices == 0 && nonfinite_attributes == 0; }
  bool degenerate() const { return repeated_vertices != 0 || zero_area_triangles != 0; }
  /// Closed, manifold, oriented, finite, nothing degenerate, out of range or of the wrong size.
  bool good() const;
};

/// Examines `mesh`, whatever it holds; never throws for bad contents. Deterministic; linear cost.
Audit validate(const Mesh& mesh);

/// One line: "closed, manifold, oriented: 1 component, genus 0, 42 vertices, 80 triangles" or what is wrong.
std::string summary(const Audit& audit);

}  // namespace meniscus::mesh
