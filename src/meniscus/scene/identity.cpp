#include <meniscus/mesh/components.h>
#include <meniscus/scene/identity.h>

#include <numeric>

namespace meniscus::scene {

void set_rest(Attributes& attributes, const std::vector<Vec3>& positions) {
  std::vector<double> rest;
  rest.reserve(3 * positions.size());
  for (const Vec3& p : positions) rest.insert(rest.end(), {p.x(), p.y(), p.z()});
  attributes.set(kRest, 3, std::move(rest));
}

void number(Attributes& attributes, std::size_t kept, std::size_t size, std::int64_t& next) {
  const auto old = attributes.integers(attribute::kId);
  std::vector<std::int64_t> ids(old.begin(), old.end());
  ids.resize(size);
  std::iota(ids.begin() + static_cast<std::ptrdiff_t>(kept), ids.end(), next);
  next += static_cast<std::int64_t>(size - kept);
  attributes.set_integers(attribute::kId, 1, std::move(ids));
}

Topology topology_of(const mesh::Mesh& mesh) {
  // A closed manifold has three edges for every two triangles.
  return {mesh::components(mesh).count,
          static_cast<std::ptrdiff_t>(mesh.positions.size()) - static_cast<std::ptrdiff_t>(mesh.triangles.size() / 2)};
}

}  // namespace meniscus::scene
