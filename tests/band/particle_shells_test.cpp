#include "support.h"

#include <meniscus/band/particle_shells.h>

#include <gtest/gtest.h>

#include <numbers>

namespace meniscus::band {
namespace {

ParticleSurface row(std::initializer_list<double> x) {
  ParticleState s;
  for (const double v : x) {
    s.position.emplace_back(v, 0, 0);
    s.velocity.push_back(Vec3::Zero());
    s.radius.push_back(1);
    s.weight.push_back(1);
  }
  return {s, {}};
}

TEST(ParticleShells, FreedomEndsWhereSpheresTouchACoveredParticle) {
  // Covered at 0; a chain that touches it; one half a radius beyond it; a pair far away.
  const ParticleSurface p = row({0, 1.9, 3.8, 6.3, 20, 21.5});
  const std::vector<double> depth{-1, 1, 1, 1, 1, 1};
  const std::vector<double> f = freedom_of_particles(p, depth);
  EXPECT_EQ(f, (std::vector<double>{0, 0, 0, 1, 1, 1}));  // 6.3 touches nobody: it is free of the chain, too
  const ParticleSurface near = row({0, 2.5});
  EXPECT_NEAR(freedom_of_particles(near, std::vector<double>{-1.0, 1.0})[1], 0.5, 1e-12);
}

TEST(ParticleShells, NewPiecesAreWhollyFreeAndLargeEnough) {
  // Covered at 0, with a chain that touches it; three far away that touch; one alone.
  const ParticleSurface p = row({0, 1.9, 3.8, 5.7, 20, 21.5, 23, 40});
  const std::vector<double> depth{-1, 1, 9, 9, 9, 9, 9, 9};
  const double one = 4 * std::numbers::pi / 3;
  EXPECT_EQ(particles_of_new_pieces(p, depth, 2.9 * one), (std::vector<std::uint32_t>{4, 5, 6}));
  EXPECT_EQ(particles_of_new_pieces(p, depth, 0), (std::vector<std::uint32_t>{4, 5, 6, 7}));
  EXPECT_TRUE(particles_of_new_pieces(p, depth, 3.1 * one).empty());
}

TEST(ParticleShells, CoversWhatIsWithinASphere) {
  const ParticleSurface p = row({0, 1, 2.5, 30});
  constexpr std::size_t kPoints = 400;
  field::PositionBatch x(kPoints);
  for (std::size_t i = 0; i < kPoints; ++i)
    x.set(i, {-8 + 0.12 * static_cast<double>(i), 0.01 * static_cast<double>(i), 0.3});
  for (const double scale : {0.5, 1.0, 4.0, 9.0}) {
    const std::vector<char> covered = p.covers(x.view(), scale);
    for (std::size_t i = 0; i < kPoints; ++i) {
      bool any = false;
      for (const Vec3& c : p.positions()) any = any || (x.view()[i] - c).norm() <= scale;
      EXPECT_EQ(covered[i] != 0, any);
    }
  }
}

TEST(ParticleShells, DepthIsSignedAlsoWhereThereAreNoSamples) {
  const Band ball = test::ball(0.25, Vec3::Zero(), 5);
  const std::vector<double> depth = depth_of_particles(ball, row({0, 4.8, 5.4, 40}));
  EXPECT_EQ(depth[0], -1);
  EXPECT_NEAR(depth[1], -0.2, 0.01);
  EXPECT_NEAR(depth[2], 0.4, 0.01);
  EXPECT_EQ(depth[3], 1);
}

TEST(ParticleShells, KeepsOnlyWhatIsFree) {
  Evolver skin(test::ball(0.25, Vec3::Zero(), 3), {});
  keep_droplets(skin, row({0, 2.5, 8}));
  ASSERT_EQ(skin.components().size(), 2u);
  EXPECT_NEAR(test::radius_of(skin.components()[1].volume), 1, 0.02);
  EXPECT_NEAR(test::radius_of(skin.components()[0].volume), 3, 0.02);
}

TEST(ParticleShells, BoundsHold) {
  Evolver skin(test::ball(0.25, Vec3::Zero(), 3), {});
  keep_covered(skin, row({3.5}), 0.8);
  EXPECT_NEAR(skin.band().sample({4.3, 0, 0}), 0, 0.03);
  confine(skin, row({3.5}), 2);
  EXPECT_NEAR(skin.band().sample({1.5, 0, 0}), 0, 0.03);
}

}  // namespace
}  // namespace meniscus::band
