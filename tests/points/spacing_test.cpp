#include <meniscus/points/spacing.h>

#include <gtest/gtest.h>

namespace meniscus::points {
namespace {

Cloud lattice(int n, double step) {
  Cloud c;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k) c.positions.push_back(step * Vec3(i, j, k));
  return c;
}

TEST(Spacing, OfALatticeIsItsStepAtAnyScale) {
  for (const double step : {0.01, 1.0, 1000.0}) EXPECT_NEAR(typical_spacing(lattice(30, step)), step, 1e-9 * step);
}

TEST(Spacing, StraysAndCoincidentPointsDoNotMatter) {
  Cloud c = lattice(8, 0.5);
  c.positions.push_back({1e9, 0, 0});
  for (int i = 0; i < 1000; ++i) c.positions.push_back(Vec3::Zero());
  EXPECT_NEAR(typical_spacing(c), 0.5, 1e-12);
}

TEST(Spacing, FewPoints) {
  EXPECT_EQ(typical_spacing({}), 0);
  EXPECT_EQ(typical_spacing(lattice(1, 1)), 0);
}

}  // namespace
}  // namespace meniscus::points
