#include <meniscus/pointset/sculpt_grid.h>

#include <meniscus/base/error.h>
#include <meniscus/base/random.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace meniscus::pointset {
namespace {

const Box kUnit{Vec3(0, 0, 0), Vec3(1, 1, 1)};

std::size_t middle(const SculptGrid& grid) {
  const auto n = grid.count();
  return static_cast<std::size_t>((n[0] / 2 * n[1] + n[1] / 2) * n[2] + n[2] / 2);
}

/// Loaded everywhere at random for a step, then let go: stretched springs and motion of every wavelength.
SculptGrid shaken(const Material& material) {
  SculptGrid grid(kUnit, 12, material);
  for (std::size_t i = 0; i < grid.size(); ++i) grid.load()[i] = static_cast<float>(random_uniform(1, i, 0)[0] - 0.5);
  grid.step(1.0);
  std::fill(grid.load().begin(), grid.load().end(), 0.0F);
  return grid;
}

TEST(SculptGrid, EnergyNeverRisesAtAnyStiffnessStepAndEffort) {
  for (const double stiffness : {0.0, 1.0, 1e6, 1e12})
    for (const double step : {1e-4, 1.0, 1e4})
      for (const int most : {1, 3, 200}) {
        SculptGrid grid = shaken({1, 0, stiffness});
        double before = grid.energy();
        ASSERT_GT(before, 0);
        for (int k = 0; k < 10; ++k) {
          grid.step(step, {}, 1e-5, most);
          const double after = grid.energy();
          ASSERT_TRUE(std::isfinite(after));
          EXPECT_LE(after, before * (1 + 1e-5)) << stiffness << " " << step << " " << most;
          before = after;
        }
      }
}

TEST(SculptGrid, DampingTakesEnergyAway) {
  SculptGrid grid = shaken({1, 1, 0.05});
  const double start = grid.energy();
  for (int k = 0; k < 200; ++k) grid.step(0.05);
  EXPECT_LT(grid.energy(), 1e-3 * start);
}

TEST(SculptGrid, RestsWhereSpringsAndLoadBalance) {
  // -stiffness · d'' = load with d = 0 at the ends, springs along x alone: a parabola. The other ends are far off.
  SculptGrid grid({Vec3(0, -4, -4), Vec3(1, 4, 4)}, 81, {1, 20, 2});
  std::fill(grid.load().begin(), grid.load().end(), 3.0F);
  for (int k = 0; k < 40; ++k) grid.step(10, {}, 1e-5, 1000);
  const auto n = grid.count();
  const double width = (n[0] - 1) * grid.voxel();
  for (int i = 0; i < n[0]; ++i) {
    const double x = i * grid.voxel();
    const auto number = static_cast<std::size_t>((i * n[1] + n[1] / 2) * n[2] + n[2] / 2);
    EXPECT_NEAR(grid.deviation()[number], 3 * x * (width - x) / (2 * 2), 2e-3);
  }
}

TEST(SculptGrid, FallsFreelyWithoutSpringsAndNewtonsLawHolds) {
  SculptGrid grid(kUnit, 8, {2, 0, 0});
  std::fill(grid.load().begin(), grid.load().end(), 3.0F);
  for (int k = 0; k < 100; ++k) grid.step(0.01);
  EXPECT_NEAR(grid.rate()[middle(grid)], 1.5, 1e-4);
  EXPECT_NEAR(grid.deviation()[middle(grid)], 0.75, 0.01);  // backward Euler: first order in the step
}

TEST(SculptGrid, HoldsItsBorderAndHeldVoxelsAndMinesMaterialByVoxel) {
  SculptGrid grid(kUnit, 10, {});
  std::fill(grid.load().begin(), grid.load().end(), 1.0F);
  const std::size_t held = middle(grid), heavy = held + 2;
  grid.hold(held);
  grid.set_material(heavy, {1e6, 4, 0});
  for (int k = 0; k < 5; ++k) grid.step(0.1);
  EXPECT_EQ(grid.deviation()[held], 0);
  EXPECT_LT(std::abs(grid.deviation()[heavy]), 1e-5);
  EXPECT_EQ(grid.deviation()[5], 0);
  EXPECT_GT(grid.deviation()[held - 2 * 100], 0.01);
}

TEST(SculptGrid, ScaledIsWhatAGreaterLoadDoes) {
  SculptGrid one(kUnit, 10, {}), seven(kUnit, 10, {});
  for (std::size_t i = 0; i < one.size(); ++i) {
    one.load()[i] = static_cast<float>(random_uniform(2, i, 0)[0]);
    seven.load()[i] = 7 * one.load()[i];
  }
  for (int k = 0; k < 4; ++k) one.step(0.1), seven.step(0.1);
  one.scale(7);
  for (std::size_t i = 0; i < one.size(); ++i) EXPECT_NEAR(one.deviation()[i], seven.deviation()[i], 1e-5);
}

TEST(SculptGrid, InterpolatesLinearFunctionsExactly) {
  for (const double scale : {0.01, 1.0, 1000.0}) {
    SculptGrid grid({scale * Vec3(-1, 2, 3), scale * Vec3(1, 2.7, 3.4)}, 21, {});
    std::vector<double> values;
    const Vec3 slope(1, -2, 0.5);
    for (std::size_t i = 0; i < grid.size(); ++i) values.push_back(slope.dot(grid.position(i)));
    grid.set_base(values);
    for (std::uint64_t k = 0; k < 50; ++k) {
      const auto u = random_uniform(3, k, 0);
      const Vec3 p = grid.bounds().min + Vec3(u[0], u[1], u[2]).cwiseProduct(grid.bounds().size());
      EXPECT_NEAR(grid.at(grid.cell(p), grid.value()), slope.dot(p), 1e-5 * scale);
    }
  }
}

TEST(SculptGrid, SameBitsForAnyNumberOfThreads) {
  const auto run = [](int threads) {
    RunOptions o;
    o.threads = threads;
    SculptGrid grid(kUnit, 20, {1, 1, 3});
    for (std::size_t i = 0; i < grid.size(); ++i) grid.load()[i] = static_cast<float>(random_uniform(4, i, 0)[0]);
    for (int k = 0; k < 3; ++k) grid.step(0.2, RunControl(o));
    return std::vector<float>(grid.deviation().begin(), grid.deviation().end());
  };
  const auto expected = run(1);
  for (const int threads : {2, 3, 5, 8}) EXPECT_EQ(run(threads), expected);
}

TEST(SculptGrid, RejectsWhatHasNoMeaning) {
  EXPECT_THROW(SculptGrid(Box{}, 10, {}), InvalidInput);
  EXPECT_THROW(SculptGrid(kUnit, 2, {}), InvalidInput);
  EXPECT_THROW(SculptGrid(kUnit, 10, {0, 1, 1}), InvalidInput);
  EXPECT_THROW(SculptGrid(kUnit, 10, {1, -1, 1}), InvalidInput);
  EXPECT_THROW(SculptGrid(kUnit, 10, {1, 1, std::nan("")}), InvalidInput);
  SculptGrid grid(kUnit, 10, {});
  EXPECT_THROW(grid.step(0), InvalidInput);
  EXPECT_THROW(grid.step(std::nan("")), InvalidInput);
  EXPECT_THROW(grid.set_base(std::vector<double>(3)), InvalidInput);
}

}  // namespace
}  // namespace meniscus::pointset
