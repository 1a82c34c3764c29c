#include <meniscus/pointset/grid_update.h>

#include <meniscus/pointset/local_fit.h>
#include <meniscus/pointset/point_set_field.h>

#include "clouds.h"

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::pointset {
namespace {

/// A sphere about the origin with a grid about its pole that holds the sphere's exact distance.
struct Scene {
  explicit Scene(double scale = 1, int local_grid = 3)
      : set(fit(test::sphere(4000, scale), {.grid = local_grid})),
        grid(Box::around(scale * Vec3(0, 0, 1), 0.5 * scale), 40, {1, 0, 0}) {
    std::vector<double> values;
    for (std::size_t i = 0; i < grid.size(); ++i) values.push_back(grid.position(i).norm() - scale);
    grid.set_base(values);
    inside = points_inside(set, grid.bounds());
  }
  std::size_t middle() const { return grid.cell(grid.bounds().center()).corner; }
  PointSet set;
  SculptGrid grid;
  std::vector<std::uint32_t> inside;
};

TEST(PointsInside, AreThoseWhoseDomainsAre) {
  const Scene s;
  ASSERT_GT(s.inside.size(), 100u);
  std::size_t expected = 0;
  for (std::size_t i = 0; i < s.set.size(); ++i) {
    const Box domain = Box::around(s.set.position(i), s.set.reach[i]);
    expected += s.grid.bounds().contains(domain.min) && s.grid.bounds().contains(domain.max);
  }
  EXPECT_EQ(s.inside.size(), expected);
}

TEST(FollowGrid, PointsAreOnTheSurfaceOfTheGridsValues) {
  for (const double scale : {0.01, 1.0, 1000.0})
    for (const int local_grid : {3, 4}) {
      Scene s(scale, local_grid);
      // Without springs values fall alike in the middle of the grid: after four steps the sphere is larger by as much.
      for (std::size_t i = 0; i < s.grid.size(); ++i) s.grid.load()[i] = static_cast<float>(-0.5 * scale);
      for (int k = 0; k < 4; ++k) {
        s.grid.step(0.1);
        const GridUpdate u = follow_grid(s.set, s.inside, s.grid, 0.1);
        EXPECT_EQ(u.moved, s.inside.size());
        EXPECT_EQ(u.lost, 0u);
        EXPECT_LT(u.farthest, 0.03 * scale);
      }
      const double grown = scale - static_cast<double>(s.grid.deviation()[s.middle()]);
      EXPECT_GT(grown, 1.03 * scale);
      for (const std::uint32_t i : s.inside) {
        EXPECT_NEAR(s.set.position(i).norm(), grown, 2e-4 * scale);
        EXPECT_LT(test::degrees_between(s.set.normal(i), s.set.position(i)), 1);
      }
      // Their own functions are the new distance.
      const PointSetField field(s.set);
      EXPECT_NEAR(field::value_at(field, (grown + 0.01 * scale) * Vec3(0, 0, 1)), 0.01 * scale, 5e-4 * scale);
    }
}

TEST(FollowGrid, WhereNothingMovesEveryBitStays) {
  Scene s;
  const std::size_t middle = s.middle();
  s.grid.load()[middle] = -1;
  s.grid.step(0.1);
  const PointSet before = s.set;
  const GridUpdate u = follow_grid(s.set, s.inside, s.grid, 0.1);
  EXPECT_GT(u.moved, 0u);
  EXPECT_LT(u.moved, s.inside.size());
  for (std::size_t i = 0; i < s.set.size(); ++i) {
    if ((before.position(i) - s.grid.position(middle)).norm() < before.reach[i] + 2 * s.grid.voxel()) continue;
    EXPECT_EQ(before.position(i), s.set.position(i));
    EXPECT_EQ(before.coefficients_of(i)[0], s.set.coefficients_of(i)[0]);
  }
}

TEST(FollowGrid, PointsWhoseSurfaceLeftAreLostAndStay) {
  Scene s;
  const PointSet before = s.set;
  for (std::size_t i = 0; i < s.grid.size(); ++i) s.grid.load()[i] = 100;
  s.grid.step(0.1);  // all values are positive now: no surface
  const GridUpdate u = follow_grid(s.set, s.inside, s.grid, 0.1);
  EXPECT_EQ(u.moved, 0u);
  EXPECT_EQ(u.lost, s.inside.size());
  EXPECT_EQ(before.x, s.set.x);
  EXPECT_EQ(before.coefficients, s.set.coefficients);
}

}  // namespace
}  // namespace meniscus::pointset
