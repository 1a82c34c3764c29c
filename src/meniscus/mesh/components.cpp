#include <meniscus/base/disjoint_sets.h>
#include <meniscus/mesh/components.h>

#include <algorithm>

namespace meniscus::mesh {

Components components(const Mesh& mesh) {
  DisjointSets sets(mesh.positions.size());
  std::vector<bool> used(mesh.positions.size(), false);
  for (const Triangle& t : mesh.triangles) {
    for (const std::int32_t v : t) used[static_cast<std::size_t>(v)] = true;
    sets.join(static_cast<std::uint32_t>(t[0]), static_cast<std::uint32_t>(t[1]));
    sets.join(static_cast<std::uint32_t>(t[0]), static_cast<std::uint32_t>(t[2]));
  }

  Components result;
  result.of_vertex.assign(mesh.positions.size(), Components::kUnused);
  for (std::uint32_t v = 0; v < result.of_vertex.size(); ++v) {
    if (!used[v]) continue;
    const std::uint32_t root = sets.root(v);  // smallest member: numbered before v, or v itself
    result.of_vertex[v] = root == v ? static_cast<std::uint32_t>(result.count++) : result.of_vertex[root];
  }
  result.of_triangle.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) result.of_triangle.push_back(result.of_vertex[static_cast<std::size_t>(t[0])]);
  return result;
}

}  // namespace meniscus::mesh
