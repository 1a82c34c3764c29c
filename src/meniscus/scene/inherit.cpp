#include <meniscus/mesh/adjacency.h>
#include <meniscus/points/neighbours.h>
#include <meniscus/scene/inherit.h>

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>

namespace meniscus::scene {
namespace {

/// A place on a mesh: weights of three vertices.
struct Place {
  std::array<std::size_t, 3> vertex{};
  std::array<double, 3> weight{1, 0, 0};
};

/// Weights of the triangle's corners nearest to p, by the foot on its plane, brought back into the triangle.
std::array<double, 3> weights_in(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  Eigen::Matrix<double, 3, 2> sides;
  sides << b - a, c - a;
  const Eigen::Matrix2d normal = sides.transpose() * sides;
  const Vec2 foot = normal.ldlt().solve(sides.transpose() * (p - a));
  std::array<double, 3> w{1 - foot.x() - foot.y(), foot.x(), foot.y()};
  double sum = 0;
  for (double& x : w) sum += x = std::clamp(x, 0.0, 1.0);
  for (double& x : w) x /= sum;
  return w;
}

Place place_of(const mesh::Mesh& mesh, const mesh::IndexLists& triangles_of, std::size_t nearest, const Vec3& p) {
  Place best{{nearest, nearest, nearest}};
  double least = (mesh.positions[nearest] - p).squaredNorm();
  for (const std::int32_t f : triangles_of[nearest]) {
    const Triangle& t = mesh.triangles[static_cast<std::size_t>(f)];
    Place place;
    for (std::size_t k = 0; k < 3; ++k) place.vertex[k] = static_cast<std::size_t>(t[k]);
    const auto at = [&](std::size_t k) -> const Vec3& { return mesh.positions[place.vertex[k]]; };
    place.weight = weights_in(p, at(0), at(1), at(2));
    Vec3 foot = Vec3::Zero();
    for (std::size_t k = 0; k < 3; ++k) foot += place.weight[k] * at(k);
    if (!((foot - p).squaredNorm() < least)) continue;
    least = (foot - p).squaredNorm();
    best = place;
  }
  return best;
}

void interpolate(std::span<const double> from, std::size_t components, const Place& place, double* to) {
  for (std::size_t c = 0; c < components; ++c) {
    to[c] = 0;
    for (std::size_t k = 0; k < 3; ++k) to[c] += place.weight[k] * from[components * place.vertex[k] + c];
  }
}

}  // namespace

Attributes inherited(const mesh::Mesh& old, std::span<const std::int32_t> kept, std::span<const Vec3> positions) {
  std::vector<std::size_t> source(kept.begin(), kept.end());
  std::vector<Place> places;
  const points::NeighbourSearch search(old.positions);
  const mesh::IndexLists triangles_of = mesh::vertex_triangles(old);
  std::vector<points::Neighbour> found;
  for (std::size_t i = kept.size(); i < positions.size(); ++i) {
    search.nearest(positions[i], 1, found);
    if (found.empty()) return {};
    source.push_back(found[0].index);
    places.push_back(place_of(old, triangles_of, found[0].index, positions[i]));
  }
  Attributes result = old.attributes.gathered(source);
  for (const Attribute& a : old.attributes) {
    if (a.is_integer()) continue;
    const auto values = result.values(a.name, a.components);
    for (std::size_t i = 0; i < places.size(); ++i)
      interpolate(std::get<0>(a.data), a.components, places[i], values.data() + a.components * (kept.size() + i));
  }
  return result;
}

}  // namespace meniscus::scene
