#include "support.h"

#include <meniscus/band/particle_surface.h>
#include <meniscus/base/error.h>
#include <meniscus/base/random.h>

#include <gtest/gtest.h>

namespace meniscus::band {
namespace {

constexpr ParticleKernel kKernels[] = {ParticleKernel::Blobs, ParticleKernel::Averaged, ParticleKernel::Anisotropic};

ParticleState particles(std::vector<Vec3> positions, double radius) {
  ParticleState s;
  s.radius.assign(positions.size(), radius);
  s.velocity.assign(positions.size(), Vec3::Zero());
  s.weight.assign(positions.size(), 1);
  s.position = std::move(positions);
  return s;
}

ParticleState block(int side, double spacing, double radius) {
  std::vector<Vec3> x;
  for (int n = 0; n < side * side * side; ++n) x.push_back(spacing * Vec3(n / (side * side), n / side % side, n % side));
  return particles(std::move(x), radius);
}

double distance(const ParticleSurface& surface, const Vec3& x, double reach) {
  double d = 0;
  surface.distance(field::PositionBatch(std::vector<Vec3>{x}).view(), reach, {&d, 1});
  return d;
}

TEST(ParticleSurface, ALoneParticleIsASphere) {
  for (const double scale : {1.0, 0.01, 1000.0})
    for (const ParticleKernel kernel : kKernels) {
      const Vec3 c = scale * Vec3(1, 2, 3);
      const ParticleSurface surface(particles({c}, 0.5 * scale), {.kernel = kernel});
      for (const Vec3& n : {Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(1, 1, 1).normalized().eval()}) {
        EXPECT_NEAR(distance(surface, c + 0.5 * scale * n, scale), 0, 1e-5 * scale);
        EXPECT_NEAR(distance(surface, c + 0.51 * scale * n, scale), 0.01 * scale, 1e-3 * scale);
        EXPECT_LT(distance(surface, c + 0.45 * scale * n, scale), 0);
      }
    }
}

TEST(ParticleSurface, AFlatTopOfParticlesIsFlat) {
  const ParticleSurface surface(block(12, 1, 0.75), {});
  double low = 1e9, high = -1e9;
  for (double x = 4; x <= 7; x += 0.25)
    for (double z = 4; z <= 7; z += 0.25) {
      const double d = distance(surface, {x, 11.7, z}, 2);
      low = std::min(low, d), high = std::max(high, d);
    }
  EXPECT_LT(high - low, 0.15) << "of a spacing";
  EXPECT_LT(distance(surface, {5.5, 5.5, 5.5}, 2), 0);
}

TEST(ParticleSurface, SphereDistanceIsThatOfTheUnion) {
  std::vector<Vec3> x;
  for (std::uint64_t i = 0; i < 60; ++i) {
    const auto u = random_uniform(13, i, 0);
    x.emplace_back(5 * u[0], 5 * u[1], 5 * u[2]);
  }
  ParticleState s = particles(x, 0.4);
  for (std::size_t i = 0; i < s.radius.size(); ++i) s.radius[i] = 0.2 + 0.01 * static_cast<double>(i);
  const ParticleSurface surface(s, {});
  std::vector<Vec3> at;
  for (std::uint64_t i = 0; i < 500; ++i) {
    const auto u = random_uniform(14, i, 0);
    at.emplace_back(7 * u[0] - 1, 7 * u[1] - 1, 7 * u[2] - 1);
  }
  std::vector<double> d(at.size());
  surface.sphere_distance(field::PositionBatch(at).view(), 1.5, 0.6, d);
  for (std::size_t i = 0; i < at.size(); ++i) {
    double exact = 0.6;
    for (std::size_t k = 0; k < s.size(); ++k) exact = std::min(exact, (at[i] - s.position[k]).norm() - 1.5 * s.radius[k]);
    if (exact > -0.6)
      EXPECT_NEAR(d[i], exact, 1e-6);
    else
      EXPECT_LE(d[i], -0.6 + 1e-6);
  }
}

TEST(ParticleSurface, StraysMakeNoSurfaceAndAreCounted) {
  ParticleState s = block(5, 1, 0.75);
  s.position.emplace_back(50, 0, 0);
  s.velocity.emplace_back(0, 0, 0);
  s.radius.push_back(0.75);
  s.weight.push_back(1);
  const ParticleSurface all(s, {}), few(s, {.min_neighbours = 2});
  EXPECT_EQ(all.strays(), 0u);
  EXPECT_EQ(few.strays(), 1u);
  EXPECT_EQ(few.positions().size(), 125u);
  EXPECT_LT(distance(all, {50, 0, 0}, 1), 0);
  EXPECT_EQ(distance(few, {50, 0, 0}, 1), 1);
}

TEST(ParticleSurface, ItsBandIsItsZeroSet) {
  for (const ParticleKernel kernel : kKernels) {
    const ParticleSurface surface(particles({{0, 0, 0}}, 1), {.kernel = kernel});
    const Band band = surface.band(0.08);
    EXPECT_NEAR(test::radius_of(test::total_volume(band)), 1, 0.01);
    for (const Vec3& n : {Vec3(1, 0, 0), Vec3(0, 0, -1)}) EXPECT_NEAR(band.sample(n), 0, 0.01);
  }
  EXPECT_TRUE(ParticleSurface(particles({}, 1), {}).band(0.1).empty());
}

TEST(ParticleSurface, TooManyBricksAreRefusedWithTheFigure) {
  const ParticleSurface surface(block(8, 1, 0.75), {});
  try {
    surface.band(0.05, 10);
    FAIL() << "was made";
  } catch (const ResourceLimit& e) {
    EXPECT_NE(std::string(e.what()).find("GB"), std::string::npos) << e.what();
  }
}

TEST(ParticleSurface, SameBitsForAnyThreadCount) {
  const ParticleState s = block(6, 0.9, 0.7);
  for (const ParticleKernel kernel : kKernels) {
    std::uint64_t one = 0;
    for (const int threads : {1, 2, 3, 5, 8}) {
      const RunControl run({.threads = threads, .on_progress = {}});
      const std::uint64_t now = test::fingerprint(ParticleSurface(s, {.kernel = kernel}, run).band(0.2, 1u << 20, run));
      if (threads == 1) one = now;
      EXPECT_EQ(now, one) << threads << " threads";
    }
  }
}

}  // namespace
}  // namespace meniscus::band
