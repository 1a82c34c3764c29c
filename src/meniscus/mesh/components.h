#pragma once

#include <meniscus/mesh/mesh.h>

#include <cstdint>
#include <limits>
#include <vector>

namespace meniscus::mesh {

/// The pieces of a mesh that hang together by shared vertices, numbered by their lowest vertex.
struct Components {
  static constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();

  std::size_t count = 0;
  std::vector<std::uint32_t> of_vertex;  ///< kUnused for vertices without a triangle
  std::vector<std::uint32_t> of_triangle;
};

/// Indices must be in range. Linear cost.
Components components(const Mesh& mesh);

}  // namespace meniscus::mesh
