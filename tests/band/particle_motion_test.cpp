#include <meniscus/band/particle_motion.h>
#include <meniscus/base/error.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace meniscus::band {
namespace {

constexpr double kDuration = 0.5;
const Vec3 kGravity(0, -9.81, 0);

/// Where and how fast a thrown particle is.
Vec3 place(const Vec3& x, const Vec3& v, double t) { return x + t * v + 0.5 * t * t * kGravity; }

points::Cloud thrown(double t, double unit_of_time = 1) {
  points::Cloud cloud;
  std::vector<double> v;
  std::vector<std::int64_t> id;
  for (std::int64_t i = 0; i < 6; ++i) {
    const double a = 0.3 * static_cast<double>(i);
    cloud.positions.push_back(place({a, 1, 0}, {1, a, -a}, t));
    const Vec3 now = unit_of_time * (Vec3(1, a, -a) + t * kGravity);
    v.insert(v.end(), {now.x(), now.y(), now.z()});
    id.push_back(10 - i);
  }
  cloud.attributes.set("v", 3, v);
  cloud.attributes.set_integers("id", 1, id);
  return cloud;
}

TEST(ParticleFrame, ReadsWhatIsThereAndLeavesOutWhatIsUnusable) {
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  points::Cloud cloud;
  cloud.positions = {{0, 0, 0}, {nan, 0, 0}, {1, 0, 0}, {2, 1e30, 0}, {3, 0, 0}, {4, 0, 0}, {5, 0, 0}};
  cloud.attributes.set("pscale", 1, {0.1, 0.1, 0.2, 0.1, 0.0, 0.3, -1.0});
  cloud.attributes.set("v", 3, {1, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, inf, 0, 0, 0, 0});
  cloud.attributes.set_integers("id", 1, {1, 2, 3, 4, 5, 6, 7});
  const ParticleFrame f = particle_frame(cloud, 7);
  EXPECT_EQ(f.dropped, 5u);
  EXPECT_EQ(f.source, (std::vector<std::size_t>{0, 2}));
  EXPECT_EQ(f.id, (std::vector<std::int64_t>{1, 3}));
  EXPECT_EQ(f.state.radius, (std::vector<double>{0.1, 0.2}));
  EXPECT_EQ(f.state.velocity[1], Vec3(2, 0, 0));
  points::Cloud bare;
  bare.positions = {{0, 0, 0}};
  EXPECT_EQ(particle_frame(bare, 7).state.radius.front(), 7);
  EXPECT_TRUE(particle_frame(bare, 7).id.empty());
  for (const double radius : {0.0, -1.0, nan, inf}) EXPECT_THROW(particle_frame(bare, radius), InvalidInput);
}

TEST(ParticleMotion, ThrownParticlesFlyAlongTheirParabola) {
  const ParticleMotion motion(particle_frame(thrown(0), 1), particle_frame(thrown(kDuration), 1), kDuration);
  EXPECT_EQ(motion.matched(), 6u);
  EXPECT_TRUE(motion.uses_velocities());
  for (const double s : {0.0, 0.25, 0.5, 0.9, 1.0}) {
    const ParticleState now = motion.at(s);
    ASSERT_EQ(now.size(), 6u);
    for (std::size_t k = 0; k < 6; ++k) {  // in the order of ids, which fall with the number
      const double a = 0.3 * static_cast<double>(5 - k);
      EXPECT_LT((now.position[k] - place({a, 1, 0}, {1, a, -a}, s * kDuration)).norm(), 1e-12);
      EXPECT_LT((now.velocity[k] - (Vec3(1, a, -a) + 0.5 * kDuration * kGravity)).norm(), 1e-12);
      EXPECT_EQ(now.weight[k], 1);
    }
  }
}

TEST(ParticleMotion, VelocitiesInAnotherUnitAreNotBelieved) {
  const ParticleMotion motion(particle_frame(thrown(0, 100), 1), particle_frame(thrown(kDuration, 100), 1), kDuration);
  EXPECT_FALSE(motion.uses_velocities());
  const ParticleState middle = motion.at(0.5);
  const Vec3 from = place({1.5, 1, 0}, {1, 1.5, -1.5}, 0), to = place({1.5, 1, 0}, {1, 1.5, -1.5}, kDuration);
  EXPECT_LT((middle.position[0] - 0.5 * (from + to)).norm(), 1e-12);
}

TEST(ParticleMotion, SpeedIsTheRootMeanSquareOfTheWays) {
  points::Cloud a = thrown(0), b = a;
  for (Vec3& p : b.positions) p += Vec3(3, 4, 0);
  const ParticleMotion motion(particle_frame(a, 1), particle_frame(b, 1), 2);
  EXPECT_DOUBLE_EQ(motion.typical_speed(), 2.5);
}

TEST(ParticleMotion, WhatComesAndWhatGoesFadesAlongItsVelocity) {
  points::Cloud a, b;
  a.positions = {{0, 0, 0}, {5, 0, 0}};
  b.positions = {{0, 0, 0}, {9, 0, 0}};
  a.attributes.set("v", 3, {0, 0, 0, 2, 0, 0});
  b.attributes.set("v", 3, {0, 0, 0, 0, 4, 0});
  a.attributes.set_integers("id", 1, {1, 2});
  b.attributes.set_integers("id", 1, {1, 3});
  const ParticleMotion motion(particle_frame(a, 1), particle_frame(b, 1), 1);
  EXPECT_EQ(motion.matched(), 1u);
  const ParticleState now = motion.at(0.25);
  ASSERT_EQ(now.size(), 3u);
  EXPECT_EQ(now.position[1], Vec3(5.5, 0, 0));
  EXPECT_EQ(now.position[2], Vec3(9, -3, 0));
  EXPECT_EQ(now.weight, (std::vector<double>{1, 0.75, 0.25}));
  EXPECT_EQ(motion.at(1).size(), 2u) << "who has gone is gone";
}

TEST(ParticleMotion, WithoutIdsNobodyIsMatchedAndOfEqualIdsTheFirst) {
  points::Cloud a, b;
  a.positions = {{0, 0, 0}, {1, 0, 0}};
  b.positions = {{0, 1, 0}, {1, 1, 0}};
  EXPECT_EQ(ParticleMotion(particle_frame(a, 1), particle_frame(b, 1), 1).matched(), 0u);
  a.attributes.set_integers("id", 1, {4, 4});
  b.attributes.set_integers("id", 1, {4, 4});
  const ParticleMotion twins(particle_frame(a, 1), particle_frame(b, 1), 1);
  EXPECT_EQ(twins.matched(), 1u);
  EXPECT_EQ(twins.at(0.5).position[0], Vec3(0, 0.5, 0));
}

TEST(ParticleMotion, RefusesAFrameThatDoesNotLast) {
  const ParticleFrame f = particle_frame(thrown(0), 1);
  for (const double duration : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_THROW(ParticleMotion(f, f, duration), InvalidInput);
}

}  // namespace
}  // namespace meniscus::band
