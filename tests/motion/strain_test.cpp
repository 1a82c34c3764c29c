#include "motion/moving_scenes.h"

#include <meniscus/motion/strain.h>
#include <meniscus/motion/velocity.h>

#include <gtest/gtest.h>

namespace meniscus::motion {
namespace {

/// A flat square of two triangles.
struct Flat {
  std::vector<Vec3> x{{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}};
  std::vector<Vec3> n{4, Vec3(0, 0, 1)};
  std::vector<Triangle> triangles{{0, 1, 2}, {0, 2, 3}};
  std::vector<std::int32_t> towards{1, 2, 3, 0};
};

Strain::Vector tangential(const TangentFrames& f, const std::vector<Vec3>& v) {
  Strain::Vector t(static_cast<Eigen::Index>(2 * v.size()));
  for (std::size_t i = 0; i < v.size(); ++i) {
    t[static_cast<Eigen::Index>(2 * i)] = f.first[i].dot(v[i]);
    t[static_cast<Eigen::Index>(2 * i + 1)] = f.second[i].dot(v[i]);
  }
  return t;
}

TEST(Strain, OfKnownMotionsOfAPlane) {
  const Flat s;
  const TangentFrames frames = tangent_frames(s.x, s.n, s.towards);
  const auto list = strains(resisting(s.x, s.n, s.triangles), s.x, s.n, {}, frames, {});
  ASSERT_EQ(list.size(), 2u);
  std::vector<Vec3> turn, stretch, shear;
  for (const Vec3& p : s.x) {
    turn.emplace_back(Vec3(0, 0, 0.7).cross(p) + Vec3(1, 2, 0));
    stretch.emplace_back(0.5 * p.x(), 0, 0);
    shear.emplace_back(0.2 * p.y(), 0, 0);
  }
  for (const Strain& e : list) {
    EXPECT_EQ(e.weight, 2);
    EXPECT_LT(e.of(tangential(frames, turn)).norm(), 1e-14);
    EXPECT_NEAR(e.of(tangential(frames, stretch)).squaredNorm(), 0.25, 1e-14);
    EXPECT_NEAR(e.of(tangential(frames, shear)).squaredNorm(), 2 * 0.1 * 0.1, 1e-14) << "the tensor's norm";
  }
}

TEST(Strain, OfABodysMotionIsNone) {
  const auto f = test::orbiting_blobs();
  f->set_time(0);
  const mesh::Mesh m = test::surface(*f, 0.15);
  const Velocities v = velocities(*f, m.positions, {});
  std::vector<std::int32_t> towards(m.positions.size());
  for (const Triangle& t : m.triangles) towards[static_cast<std::size_t>(t[0])] = t[1];
  const TangentFrames frames = tangent_frames(m.positions, v.normal, towards);
  std::vector<Vec3> exact;
  for (const Vec3& p : m.positions) exact.push_back(test::orbit_velocity(p));
  const Strain::Vector t = tangential(frames, exact);
  double without = 0;
  const Resisting r = resisting(m.positions, v.normal, m.triangles);
  EXPECT_EQ(r.triangles.size(), m.triangles.size());
  for (const Strain& e : strains(r, m.positions, v.normal, v.normal_speed, frames, {})) EXPECT_LT(e.of(t).norm(), 1e-11);
  for (const Strain& e : strains(r, m.positions, v.normal, {}, frames, {})) without = std::max(without, e.of(t).norm());
  EXPECT_GT(without, 0.1) << "normal speeds are part of it";
}

TEST(Resisting, LeavesOutCreasesAndNeedles) {
  Flat s;
  s.n[3] = Vec3(1, 0, 0);
  EXPECT_EQ(resisting(s.x, s.n, s.triangles).triangles, (std::vector<Triangle>{{0, 1, 2}}));
  s.n[3] = Vec3(0, 0, 1);
  s.x[1] = {1, 1 - 1e-14, 0};
  EXPECT_EQ(resisting(s.x, s.n, s.triangles).triangles, (std::vector<Triangle>{{0, 2, 3}}));
}

}  // namespace
}  // namespace meniscus::motion
