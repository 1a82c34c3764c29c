#include <meniscus/base/random.h>
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

// Nearest neighbours come nearer as order is lost; the volume a particle has does not change.
TEST(BulkSpacing, IsThatOfTheVolumeWhateverTheOrder) {
  for (const double step : {0.01, 1.0, 1000.0})
    for (const double disorder : {0.0, 0.2, 0.4}) {
      Cloud c = lattice(20, step);
      for (std::size_t i = 0; i < c.size(); ++i) {
        const auto u = random_uniform(7, i, 0);
        c.positions[i] += step * disorder * (2 * Vec3(u[0], u[1], u[2]) - Vec3::Ones());
      }
      EXPECT_NEAR(bulk_spacing(c), step, 0.06 * step) << disorder;
      if (disorder > 0.3) EXPECT_LT(typical_spacing(c), 0.8 * step);
    }
}

TEST(BulkSpacing, SprayAndCoincidentPointsDoNotMatter) {
  Cloud c = lattice(16, 0.5);
  const double alone = bulk_spacing(c);
  for (int i = 0; i < 200; ++i) c.positions.push_back(Vec3(50 + 3 * i, 2 * i, 7));
  for (int i = 0; i < 1000; ++i) c.positions.push_back(Vec3::Zero());
  EXPECT_NEAR(bulk_spacing(c), alone, 0.02 * alone);
}

TEST(BulkSpacing, SheetsAndThreadsStayNearTheirOwnSpacing) {
  Cloud sheet, thread;
  for (int i = 0; i < 40; ++i) {
    thread.positions.push_back(Vec3(i, 0, 0));
    for (int j = 0; j < 40; ++j) sheet.positions.push_back(Vec3(i, j, 0));
  }
  for (const Cloud& c : {sheet, thread}) {
    EXPECT_GE(bulk_spacing(c), 1);
    EXPECT_LE(bulk_spacing(c), 1.8 + 1e-12);
  }
  EXPECT_EQ(bulk_spacing(lattice(2, 0.5)), 0.5) << "too few to tell";
}

TEST(Spacing, FewPoints) {
  EXPECT_EQ(typical_spacing({}), 0);
  EXPECT_EQ(typical_spacing(lattice(1, 1)), 0);
}

}  // namespace
}  // namespace meniscus::points
