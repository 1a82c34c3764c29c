#include <meniscus/mesh/components.h>

#include <algorithm>
#include <numeric>

namespace meniscus::mesh {
namespace {

/// Disjoint sets whose root is always the smallest member.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0U); }

  std::uint32_t root(std::uint32_t v) {
    while (parent_[v] != v) v = parent_[v] = parent_[parent_[v]];
    return v;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace

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
