#include <meniscus/motion/rigid_fit.h>

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace meniscus::motion {
namespace {

/// Points of an ellipsoid with unlike axes, and their normals.
struct Point {
  Vec3 x, n;
};
std::vector<Point> ellipsoid(const Vec3& axes) {
  std::vector<Point> list;
  for (int i = 0; i < 40; ++i) {
    const double z = 1 - (2 * i + 1) / 40.0;
    const Vec3 s(std::sqrt(1 - z * z) * std::cos(2.4 * i), std::sqrt(1 - z * z) * std::sin(2.4 * i), z);
    list.push_back({axes.cwiseProduct(s), s.cwiseQuotient(axes).normalized()});
  }
  return list;
}

TEST(NormalSpeedFit, FindsTheMotionOfABody) {
  const RigidMotion wanted{{1, -2, 0.5}, {0.3, 0.1, -0.7}};
  NormalSpeedFit fit;
  for (const Point& p : ellipsoid({1, 0.8, 0.6})) fit.add(p.x, p.n, p.n.dot(wanted.at(p.x)), 2);
  const auto answer = fit.solve({1e-3, 1e-2});
  const RigidMotion& found = answer.change;
  EXPECT_EQ(answer.confidence, 1);
  EXPECT_EQ(answer.doubtful, 0u);
  EXPECT_LT((found.u - wanted.u).norm() + (found.turning - wanted.turning).norm(), 1e-12);
}

TEST(NormalSpeedFit, AddsNothingThatNormalSpeedsDoNotTell) {
  // A sphere may turn as it likes; the last numbers are noise.
  NormalSpeedFit fit;
  double noise = 1e-14;
  for (const Point& p : ellipsoid({1, 1, 1})) fit.add(p.x, p.n, p.n.x() + (noise = -noise), 1);
  const auto answer = fit.solve({1e-3, 1e-2});
  const RigidMotion& found = answer.change;
  ASSERT_EQ(answer.doubtful, 3u);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(answer.doubt[k], 1);
    EXPECT_LT(answer.directions[k].u.norm(), 1e-6) << "turning is all that remains open";
  }
  EXPECT_LT((found.u - Vec3(1, 0, 0)).norm(), 1e-12);
  EXPECT_LT(found.turning.norm(), 1e-12);
}

TEST(NormalSpeedFit, KnowsNothingOfNoPoints) {
  const auto answer = NormalSpeedFit().solve({1e-3, 1e-2});
  EXPECT_EQ(answer.change.u, Vec3(0, 0, 0));
  EXPECT_EQ(answer.confidence, 0);
}

TEST(TurningFit, FindsTheTurning) {
  const RigidMotion wanted{{0, 0, 0}, {0.3, 0.1, -0.7}};
  TurningFit fit;
  TurningFit line;
  for (const Point& p : ellipsoid({1, 0.8, 0.6})) {
    fit.add(p.x, wanted.at(p.x), 1);
    line.add({p.x.x(), 0, 0}, {0, 0, p.x.x()}, 1);
  }
  EXPECT_LT((fit.solve() - wanted.turning).norm(), 1e-10);
  EXPECT_LT((line.solve() - Vec3(0, -1, 0)).norm(), 1e-10) << "offsets along x leave the turning about x open";
}

}  // namespace
}  // namespace meniscus::motion
