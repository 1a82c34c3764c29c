#include <meniscus/sample/repulsion.h>

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::sample {
namespace {

constexpr double kAlpha = 6;

SurfacePoints hexagonal(double spacing, int rings) {
  SurfacePoints p;
  p.push_back(Vec3::Zero(), Vec3::UnitZ());
  for (int a = -rings; a <= rings; ++a)
    for (int b = -rings; b <= rings; ++b)
      if (a != 0 || b != 0) p.push_back(spacing * Vec3(a + 0.5 * b, 0.5 * std::sqrt(3.0) * b, 0), Vec3::UnitZ());
  return p;
}

Repulsion at(const SurfacePoints& p, const std::vector<double>& sigma, std::size_t i) {
  std::vector<double> reach = sigma;
  for (double& r : reach) r *= kRepulsionReach;
  return repulsion(p, sigma, kAlpha, i, find_neighbours(p.positions(), reach).of(i));
}

TEST(Repulsion, TwoEqualParticlesSeparate) {
  SurfacePoints p;
  p.push_back({0, 0, 0}, Vec3::UnitZ());
  p.push_back({1, 0, 0}, Vec3::UnitZ());
  const std::vector<double> sigma{1, 1};
  const Repulsion left = at(p, sigma, 0), right = at(p, sigma, 1);
  const double e = kAlpha * std::exp(-0.5);
  EXPECT_NEAR(left.velocity.x(), -2 * e, 1e-12);
  EXPECT_NEAR(right.velocity.x(), 2 * e, 1e-12);
  EXPECT_NEAR(left.energy, e, 1e-12);
  EXPECT_NEAR(left.energy_slope, e, 1e-12);
}

TEST(Repulsion, IsDownTheGradientOfTheEnergyForUnequalRadii) {
  // P^i = −(σ^i)² ∂/∂p^i of Σ over both particles of their energies E^ij + E^ji ... [WH94 (9), sign corrected]
  const std::vector<double> sigma{0.7, 1.3};
  const auto energy = [&](double x) {
    return kAlpha * (std::exp(-x * x / (2 * sigma[0] * sigma[0])) + std::exp(-x * x / (2 * sigma[1] * sigma[1])));
  };
  SurfacePoints p;
  p.push_back({0.9, 0, 0}, Vec3::UnitZ());
  p.push_back({0, 0, 0}, Vec3::UnitZ());
  const double h = 1e-5;
  const double slope = (energy(0.9 + h) - energy(0.9 - h)) / (2 * h);
  EXPECT_NEAR(at(p, sigma, 0).velocity.x(), -sigma[0] * sigma[0] * slope, 1e-8);
}

TEST(Repulsion, HexagonalLatticeRestsAtTheSpacingOfThePaper) {
  for (const double scale : {0.01, 1.0, 1000.0}) {
    const SurfacePoints p = hexagonal(2.017 * scale, 5);
    const Repulsion r = at(p, std::vector<double>(p.size(), scale), 0);
    EXPECT_NEAR(r.energy / kAlpha, 0.8, 0.003);
    EXPECT_NEAR(r.velocity.norm() / scale, 0, 1e-12);
  }
}

TEST(Repulsion, DoesNotActThroughAThinBody) {
  SurfacePoints p;
  p.push_back({0, 0, 0.1}, Vec3::UnitZ());
  p.push_back({0, 0, -0.1}, -Vec3::UnitZ());
  EXPECT_EQ(at(p, {1, 1}, 0).energy, 0);
}

}  // namespace
}  // namespace meniscus::sample
