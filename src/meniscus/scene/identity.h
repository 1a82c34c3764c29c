#pragma once

#include <meniscus/base/attributes.h>
#include <meniscus/mesh/mesh.h>

#include <cstdint>
#include <string_view>
#include <vector>

namespace meniscus::scene {

/// Attribute of carried vertices and points: where they were in the first frame.
inline constexpr std::string_view kRest = "rest";

/// Sets kRest to where the vertices are.
void set_rest(Attributes& attributes, const std::vector<Vec3>& positions);

/// Gives what follows the first `kept` of `size` elements ids of their own, from `next` on, which is raised.
void number(Attributes& attributes, std::size_t kept, std::size_t size, std::int64_t& next);

/// What tells closed surfaces apart that no motion carries into one another.
struct Topology {
  std::size_t components = 0;
  std::ptrdiff_t euler = 0;
  bool operator==(const Topology&) const = default;
};

/// Of a closed manifold. Linear cost.
Topology topology_of(const mesh::Mesh& mesh);

}  // namespace meniscus::scene
