#pragma once

#include <meniscus/base/random.h>
#include <meniscus/points/cloud.h>

#include <cmath>
#include <cstdint>
#include <vector>

namespace meniscus::test {

/// Two drops of particles that fly into one another, merge and swing: soft spheres one apart that stick together and rub.
/// Plain and deterministic; made for tests and benchmarks that need a merge.
class CollidingDrops {
 public:
  CollidingDrops(double radius, double other_radius, double speed) {
    const double gap = radius + other_radius + 2.5;
    fill({-0.5 * gap, 0.15 * radius, 0}, radius, {speed, 0, 0});
    fill({0.5 * gap, -0.15 * radius, 0}, other_radius, {-speed, 0, 0});
    for (int i = 0; i < 300; ++i) step(0.04, true);  // each comes to rest within itself first
  }

  /// Goes on by one frame of one second.
  void advance() {
    constexpr int kSteps = 10;
    for (int i = 0; i < kSteps; ++i) step(1.0 / kSteps, false);
  }

  points::Cloud cloud() const {
    points::Cloud out;
    out.positions = x_;
    std::vector<double> v;
    std::vector<std::int64_t> id;
    for (std::size_t i = 0; i < x_.size(); ++i) {
      v.insert(v.end(), {v_[i].x(), v_[i].y(), v_[i].z()});
      id.push_back(static_cast<std::int64_t>(i));
    }
    out.attributes.set("v", 3, std::move(v));
    out.attributes.set_integers("id", 1, std::move(id));
    return out;
  }

 private:
  void fill(const Vec3& center, double radius, const Vec3& velocity) {
    const int n = static_cast<int>(radius) + 1;
    for (int i = -n; i <= n; ++i)
      for (int j = -n; j <= n; ++j)
        for (int k = -n; k <= n; ++k) {
          if (Vec3(i, j, k).norm() > radius) continue;
          const auto u = random_uniform(3, x_.size(), 0);
          x_.push_back(center + Vec3(i, j, k) + 0.2 * Vec3(u[0] - 0.5, u[1] - 0.5, u[2] - 0.5));
          v_.push_back(velocity);
        }
  }
  void step(double dt, bool at_rest) {
    constexpr double kReach = 1.6, kPush = 8, kPull = 1, kRub = 1.5;
    std::vector<Vec3> force(x_.size(), Vec3::Zero());
    for (std::size_t i = 0; i < x_.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) {
        const Vec3 d = x_[i] - x_[j];
        const double square = d.squaredNorm();
        if (square >= kReach * kReach || square < 1e-12) continue;
        const double r = std::sqrt(square);
        const double f = r < 1 ? kPush * (1 - r) : -kPull * (r - 1) * (kReach - r);
        const Vec3 both = f / r * d - kRub * (1 - r / kReach) * (v_[i] - v_[j]);
        force[i] += both;
        force[j] -= both;
      }
    for (std::size_t i = 0; i < x_.size(); ++i) {
      if (!at_rest) v_[i] += dt * force[i];
      x_[i] += dt * (at_rest ? force[i] : v_[i]);
    }
  }

  std::vector<Vec3> x_, v_;
};

}  // namespace meniscus::test
