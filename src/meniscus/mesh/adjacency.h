#pragma once

#include <meniscus/mesh/mesh.h>

#include <cstdint>
#include <span>
#include <vector>

namespace meniscus::mesh {

/// Lists of indices, one list per element, stored end to end.
struct IndexLists {
  std::vector<std::size_t> begin{0};  ///< list i is items[begin[i]] … items[begin[i + 1] - 1]
  std::vector<std::int32_t> items;

  std::size_t size() const { return begin.size() - 1; }
  std::span<const std::int32_t> operator[](std::size_t i) const {
    return {items.data() + begin[i], begin[i + 1] - begin[i]};
  }
};

/// An undirected edge, a < b, and how many triangles run along it either way. Inside a closed oriented manifold both are 1.
struct Edge {
  std::int32_t a = 0;
  std::int32_t b = 0;
  std::int32_t forward = 0;   ///< triangles that run a -> b
  std::int32_t backward = 0;  ///< triangles that run b -> a

  std::int32_t uses() const { return forward + backward; }
};

/// The triangles at each vertex, in rising order. Indices must be in range. Linear cost.
IndexLists vertex_triangles(const Mesh& mesh);

/// The neighbours of each vertex along edges, rising, each once. Indices must be in range. Linear cost.
IndexLists vertex_neighbours(const Mesh& mesh);

/// Every edge once, sorted by (a, b). Sides of triangles that use one vertex twice in a row are no edges. Indices must be
/// in range. Linear cost.
std::vector<Edge> edges(const Mesh& mesh);

}  // namespace meniscus::mesh
