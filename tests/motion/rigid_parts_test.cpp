#include "motion/moving_scenes.h"

#include <meniscus/motion/rigid_parts.h>
#include <meniscus/motion/strain.h>

#include <gtest/gtest.h>

namespace meniscus::motion {
namespace {

RigidParts parts_of(const mesh::Mesh& m, const Velocities& v) {
  const Resisting r = resisting(m.positions, v.normal, m.triangles);
  return RigidParts(m.positions, r.triangles, r.area, v);
}

TEST(RigidParts, EveryPartHasItsOwnMotion) {
  // Blobs that turn about y as one body, and far from them a ball that falls.
  for (const double scale : {0.01, 1.0, 1000.0}) {
    std::vector<std::unique_ptr<field::Field>> list;
    list.push_back(field::transform(test::three_blobs(scale), {0.0, 0.0, 0.0}, {0.0, test::moving("90*t"), 0.0}, 1.0));
    list.push_back(field::sphere({5 * scale, test::moving(test::text(-2 * scale) + "*t"), 0.0}, scale));
    const auto f = field::set_union(std::move(list));
    f->set_time(0);
    const mesh::Mesh m = test::surface(*f, 0.12 * scale);
    Velocities v = velocities(*f, m.positions, {.kind = Velocity::Normal});
    // Of the ball's turning normal speeds know nothing; the guide says that it does not turn.
    for (std::size_t i = 0; i < m.positions.size(); ++i)
      if (m.positions[i].x() > 3 * scale) v.velocity[i] = Vec3(0, -2 * scale, 0);
    const RigidParts r = parts_of(m, v);
    EXPECT_TRUE(r.all_rigid());
    const double w = std::acos(-1.0) / 2;
    for (std::size_t i = 0; i < m.positions.size(); ++i) {
      const bool ball = m.positions[i].x() > 3 * scale;
      const Vec3 exact = ball ? Vec3(0, -2 * scale, 0) : Vec3(w * test::orbit_velocity(m.positions[i]));
      EXPECT_LT((r.velocity()[i] - exact).norm(), 1e-10 * scale);
      EXPECT_EQ(r.excess()[i], 0);
    }
  }
}

TEST(RigidParts, WhatIsNoBodyKeepsAnExcess) {
  const auto f = test::approaching_blobs();
  f->set_time(0);
  const mesh::Mesh m = test::surface(*f, 0.1);
  Velocities v = velocities(*f, m.positions, {});
  v.singular[0] = 1;
  const RigidParts r = parts_of(m, v);
  EXPECT_FALSE(r.all_rigid());
  double most = 0;
  double own = 0;
  for (std::size_t i = 1; i < m.positions.size(); ++i) {
    EXPECT_NEAR(r.velocity()[i].dot(v.normal[i]) + r.excess()[i], v.normal_speed[i], 1e-12);
    most += r.excess()[i] * r.excess()[i];
    own += v.normal_speed[i] * v.normal_speed[i];
  }
  EXPECT_GT(most, 0.01 * own);
  EXPECT_LT(most, own) << "a body explains some of it";
}

TEST(RigidParts, CreasesPartBodies) {
  // A stick that pushes through a ball at rest: each is a body of its own.
  std::vector<std::unique_ptr<field::Field>> list;
  list.push_back(field::sphere({0.0, 0.0, 0.0}, 0.8));
  list.push_back(field::capsule({test::moving("-2+t"), 0.0, 0.0}, {test::moving("2+t"), 0.0, 0.0}, 0.2));
  const auto f = field::set_union(std::move(list));
  f->set_time(0);
  const mesh::Mesh m = test::surface(*f, 0.06);
  const Velocities v = velocities(*f, m.positions, {});
  const RigidParts r = parts_of(m, v);
  for (std::size_t i = 0; i < m.positions.size(); ++i) {
    const double from_axis = std::hypot(m.positions[i].y(), m.positions[i].z());
    if (from_axis > 0.4) EXPECT_LT(r.velocity()[i].norm(), 1e-9);
    if (std::abs(m.positions[i].x()) > 1) EXPECT_LT((r.velocity()[i] - Vec3(1, 0, 0)).norm(), 1e-9);
  }
}

TEST(RigidParts, WhatNormalSpeedsDoNotTellIsTakenOut) {
  // A ball that is blown up: it has an excess, and may turn as it likes.
  const auto f = field::sphere({0.0, 0.0, 0.0}, test::moving("1+0.1*t"));
  f->set_time(0);
  const mesh::Mesh m = test::surface(*f, 0.2);
  const Velocities v = velocities(*f, m.positions, {});
  const RigidParts r = parts_of(m, v);
  std::vector<Vec3> turning, other, both;
  for (std::size_t i = 0; i < m.positions.size(); ++i) {
    const Vec3& x = m.positions[i];
    turning.emplace_back(Vec3(0.3, -1, 2).cross(x));
    other.emplace_back(x.x() * (Vec3(1, 0, 0) - x.x() * x));  // towards both poles
    both.push_back(turning[i] + other[i]);
  }
  r.remove_untold(both);
  for (std::size_t i = 0; i < both.size(); ++i) EXPECT_LT((both[i] - other[i]).norm(), 0.02);
  r.remove_untold(turning);
  for (const Vec3& t : turning) EXPECT_LT(t.norm(), 1e-9);
}

TEST(RigidParts, VerticesThatNoTriangleHoldsFollowTheirVelocities) {
  const Velocities v{{{1, 2, 3}, {0, 0, 1}}, {{0, 0, 1}, {0, 0, 1}}, {3, 1}, {0, 0}, {1, 1}, {0, 0}};
  const std::vector<Vec3> x{{0, 0, 0}, {1, 0, 0}};
  const RigidParts r(x, {}, {}, v);
  EXPECT_EQ(r.velocity(), v.velocity);
  EXPECT_TRUE(r.all_rigid());
}

}  // namespace
}  // namespace meniscus::motion
