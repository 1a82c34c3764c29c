#include <meniscus/band/velocity_grid.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace meniscus::band {
namespace {

std::uint64_t key(std::int64_t x, std::int64_t y, std::int64_t z) {
  const auto u = [](std::int64_t v) { return static_cast<std::uint64_t>(v + (1 << 20)) & 0x1FFFFF; };
  return u(x) << 42 | u(y) << 21 | u(z);
}

}  // namespace

/// The 27 nodes around a point: first node and weights per axis.
struct VelocityGrid::Stencil {
  std::array<std::int64_t, 3> first;
  double w[3][3];
  std::uint64_t base() const { return key(first[0], first[1], first[2]); }
  template <class Work>
  void for_nodes(const Work& work) const {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        for (int k = 0; k < 3; ++k) work(key(first[0] + i, first[1] + j, first[2] + k), w[0][i] * w[1][j] * w[2][k]);
  }
};

VelocityGrid::Stencil VelocityGrid::stencil(const Vec3& x) const {
  Stencil s{};
  for (int a = 0; a < 3; ++a) {
    const double c = std::clamp(x[a] / cell_, -1e6, 1e6);
    const double middle = std::round(c), f = c - middle;
    s.first[static_cast<std::size_t>(a)] = static_cast<std::int64_t>(middle) - 1;
    s.w[a][0] = 0.5 * (0.5 - f) * (0.5 - f);
    s.w[a][1] = 0.75 - f * f;
    s.w[a][2] = 0.5 * (0.5 + f) * (0.5 + f);
  }
  return s;
}

VelocityGrid::VelocityGrid(std::span<const Vec3> position, std::span<const Vec3> velocity, std::span<const double> weight,
                           double cell)
    : cell_(cell) {
  for (std::size_t p = 0; p < position.size(); ++p)
    stencil(position[p]).for_nodes([&](std::uint64_t k, double w) {
      const auto [it, fresh] = index_.try_emplace(k, static_cast<std::uint32_t>(nodes_.size()));
      if (fresh) nodes_.emplace_back();
      Node& n = nodes_[it->second];
      n.mass += w * weight[p];
      n.momentum += w * weight[p] * velocity[p];
    });
}

Vec3 VelocityGrid::at(const Vec3& x) const {
  double mass = 0;
  Vec3 momentum = Vec3::Zero();
  stencil(x).for_nodes([&](std::uint64_t k, double w) {
    const auto it = index_.find(k);
    if (it == index_.end()) return;
    mass += w * nodes_[it->second].mass;
    momentum += w * nodes_[it->second].momentum;
  });
  return mass > 1e-12 ? Vec3(momentum / mass) : Vec3(Vec3::Zero());
}

}  // namespace meniscus::band
