#include <meniscus/band/far_distance.h>
#include <meniscus/field/combine.h>
#include <meniscus/field/primitives.h>

#include <meniscus/base/random.h>

#include <gtest/gtest.h>

namespace meniscus::band {
namespace {

/// A point of [-1, 1]³.
Vec3 somewhere(std::uint64_t i) {
  const auto u = random_uniform(11, i, 0);
  return {2 * u[0] - 1, 2 * u[1] - 1, 2 * u[2] - 1};
}

TEST(FarDistance, IsExactNearTheSurfaceAndRightToAFewPerCentFarAway) {
  for (const double scale : {1.0, 0.01, 1000.0}) {
    const auto ball = field::sphere({0, 0, 0}, scale);
    const double voxel = 0.1 * scale;
    const FarDistance distance(*ball, voxel, Box::around(Vec3::Zero(), 3 * scale));
    for (std::uint64_t i = 0; i < 2000; ++i) {
      const Vec3 x = 3 * scale * somewhere(i);
      const double exact = x.norm() - scale, found = distance.at(x);
      const double allowed = std::abs(exact) < 3 * voxel ? 0.05 * voxel : 0.05 * std::abs(exact) + 0.5 * voxel;
      EXPECT_NEAR(found, exact, allowed) << x.transpose() / scale;
      EXPECT_EQ(found < 0, exact < 0);
    }
  }
}

TEST(FarDistance, BeyondTheBoxItIsThatOfTheBox) {
  const auto ball = field::sphere({0, 0, 0}, 1);
  const FarDistance distance(*ball, 0.1, Box::around(Vec3::Zero(), 2));
  EXPECT_DOUBLE_EQ(distance.at({50, 0, 0}), distance.at({2, 0, 0}));
  EXPECT_DOUBLE_EQ(distance.at({-7, 9, 0.3}), distance.at({-2, 2, 0.3}));
}

TEST(FarDistance, TellsTheDeepestPointOfEveryPartThatNothingTouches) {
  field::Inputs balls;
  for (const double x : {-2.0, 0.0, 2.0}) balls.push_back(field::sphere({x, 0, 0}, 0.7));
  const auto three = field::set_union(std::move(balls));
  const FarDistance distance(*three, 0.08, Box{{-3, -1, -1}, {3, 1, 1}});
  const field::PositionBatch nodes = distance.nodes();
  std::vector<double> middle;
  for (std::size_t i = 0; i < nodes.x.size(); ++i) middle.push_back(nodes.view()[i].norm() - 0.3);
  const auto deep = distance.untouched(middle);
  ASSERT_EQ(deep.size(), 2u);
  for (const auto& d : deep) {
    EXPECT_NEAR(d.depth, 0.7, 0.15);
    EXPECT_LT((d.x - Vec3(d.x.x() < 0 ? -2 : 2, 0, 0)).norm(), 0.15);
  }
  EXPECT_LT(deep[0].x.x() * deep[1].x.x(), 0);
  EXPECT_EQ(distance.untouched(std::vector<double>(middle.size(), 1)).size(), 3u);
  EXPECT_TRUE(distance.untouched(std::vector<double>(middle.size(), -1)).empty());
}

}  // namespace
}  // namespace meniscus::band
