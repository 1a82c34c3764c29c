#pragma once

#include <meniscus/base/vec.h>

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

namespace meniscus::band {

/// The smooth part of particle velocities: their means under quadratic B-splines on a coarse sparse grid. Thermal or
/// turbulent scatter of single particles averages out over about three cells.
class VelocityGrid {
 public:
  /// `cell` > 0, world units. `weight` one number per particle.
  VelocityGrid(std::span<const Vec3> position, std::span<const Vec3> velocity, std::span<const double> weight, double cell);

  /// Mean velocity at a point; zero where no particle reaches. Compact runs of points are cheap.
  Vec3 at(const Vec3& x) const;

 private:
  struct Node {
    double mass = 0;
    Vec3 momentum = Vec3::Zero();
  };
  struct Stencil;
  Stencil stencil(const Vec3& x) const;

  double cell_;
  std::unordered_map<std::uint64_t, std::uint32_t> index_;
  std::vector<Node> nodes_;
};

}  // namespace meniscus::band
