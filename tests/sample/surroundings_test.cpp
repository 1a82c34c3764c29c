#include <meniscus/sample/surroundings.h>

#include <gtest/gtest.h>

#include <algorithm>

namespace meniscus::sample {
namespace {

/// A square lattice with the given step.
SurfacePoints lattice(int n, double step) {
  SurfacePoints p;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) p.push_back(step * Vec3(i, j, 0), Vec3(0, 0, 1));
  return p;
}

void move(SurfacePoints& p, double way) {
  for (std::size_t i = 0; i < p.size(); ++i) p.set_position(i, p.position(i) + Vec3(way, 0, 0));
}

TEST(Surroundings, ListAllWithinTheirReach) {
  for (const double scale : {0.01, 1.0, 1000.0}) {
    const SurfacePoints p = lattice(7, scale);
    const std::vector<double> spacing(p.size(), scale);
    Surroundings near(2.5, 0.1);
    ASSERT_TRUE(near.refresh(p, spacing, {}));
    for (std::size_t i = 0; i < p.size(); ++i)
      for (std::size_t j = 0; j < p.size(); ++j) {
        const auto list = near.lists().of(i);
        const bool listed = std::find(list.begin(), list.end(), j) != list.end();
        EXPECT_EQ(listed, i != j && (p.position(i) - p.position(j)).norm() < 2.5 * scale) << i << " " << j;
      }
  }
}

TEST(Surroundings, AreFoundAnewWhenPointsHaveMovedOrAreOthers) {
  SurfacePoints p = lattice(8, 1);
  std::vector<double> spacing(p.size(), 1);
  Surroundings near(2.5, 0.1);
  EXPECT_TRUE(near.refresh(p, spacing, {})) << "there were none";
  EXPECT_FALSE(near.refresh(p, spacing, {}));
  move(p, 0.09);
  EXPECT_FALSE(near.refresh(p, spacing, {}));
  move(p, 0.02);
  EXPECT_TRUE(near.refresh(p, spacing, {})) << "0.11 in all";
  move(p, 0.09);
  EXPECT_FALSE(near.refresh(p, spacing, {})) << "counted from the last search";
  p.push_back(Vec3(-1, 0, 0), Vec3(0, 0, 1));
  spacing.push_back(1);
  EXPECT_TRUE(near.refresh(p, spacing, {})) << "one more point";
}

}  // namespace
}  // namespace meniscus::sample
