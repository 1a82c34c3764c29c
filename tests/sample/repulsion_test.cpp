#include <meniscus/base/random.h>
#include <meniscus/field/cpu.h>
#include <meniscus/sample/repulsion.h>
#include <meniscus/sample/repulsion_kernel.h>

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

TEST(Repulsion, SameBitsOnEveryProcessor) {
  SurfacePoints p;
  std::vector<double> sigma;
  std::vector<std::uint32_t> list;
  for (std::uint32_t i = 0; i < 40; ++i) {
    const auto u = random_uniform(2, i, 0), v = random_uniform(2, i, 1);
    p.push_back(3 * Vec3(u[0], u[1], u[2]), Vec3(v[0] - 0.5, v[1] - 0.5, 1).normalized());
    sigma.push_back(0.5 + v[2]);
    if (i > 0) list.push_back(i);
  }
  const repulsion_kernel::Input in{p.x.data(),   p.y.data(),  p.z.data(),
                                   p.nx.data(),  p.ny.data(), p.nz.data(),
                                   sigma.data(), kAlpha,      kRepulsionReach * kRepulsionReach};
  const auto numbers = [&](repulsion_kernel::Kernel kernel, std::uint32_t count) {
    const repulsion_kernel::Sums s = kernel(in, 0, list.data(), count);
    return std::vector<double>{s.px, s.py, s.pz, s.energy, s.moment};
  };
  // Every length of the last group.
  for (std::uint32_t count = 0; count < list.size(); ++count) {
    const auto plain = numbers(repulsion_kernel::sums<field::packet::Sse2>, count);
    if (field::has_avx2()) EXPECT_EQ(numbers(repulsion_kernel::sums_avx2, count), plain) << count;
    if (field::has_avx512()) EXPECT_EQ(numbers(repulsion_kernel::sums_avx512, count), plain) << count;
    double energy = 0;
    for (std::uint32_t k = 0; k < count; ++k) {
      const double r2 = (p.position(0) - p.position(list[k])).squaredNorm();
      energy += kAlpha * same_sheet(p, 0, list[k]) * std::exp(-0.5 * r2 / (sigma[0] * sigma[0]));
    }
    EXPECT_NEAR(plain[3], energy, 1e-11);
  }
}

}  // namespace
}  // namespace meniscus::sample
