#include <meniscus/field/grid.h>

#include <meniscus/base/error.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace meniscus::field {
namespace {

/// A brick of one value.
std::vector<float> flat(std::initializer_list<float> per_brick) {
  std::vector<float> values;
  for (const float v : per_brick) values.insert(values.end(), Grid::kBrickVoxels, v);
  return values;
}

TEST(Grid, SortsBricksTogetherWithTheirValues) {
  const Grid grid(0.5, Vec3(1, 2, 3), 4, {{2, 0, 0}, {-1, 5, 5}, {2, -7, 0}}, flat({1, 2, 3}));
  ASSERT_EQ(grid.bricks().size(), 3u);
  EXPECT_EQ(grid.bricks()[0], (Coord{-1, 5, 5}));
  EXPECT_EQ(grid.bricks()[1], (Coord{2, -7, 0}));
  EXPECT_EQ(grid.bricks()[2], (Coord{2, 0, 0}));
  EXPECT_EQ(grid.brick(0)[0], 2);
  EXPECT_EQ(grid.brick(1)[511], 3);
  EXPECT_EQ(grid.brick(2)[7], 1);
  EXPECT_EQ(grid.bounds().min, Vec3(1 - 4, 2 - 28, 3));
  EXPECT_EQ(grid.bounds().max, Vec3(1 + 11.5, 2 + 23.5, 3 + 23.5));
}

TEST(Grid, FindsExactlyItsBricks) {
  std::mt19937 random(1);
  std::uniform_int_distribution<std::int32_t> index(-15, 15);
  std::vector<Coord> bricks;
  for (int n = 0; n < 3000; ++n) bricks.push_back({index(random), index(random), index(random)});
  std::sort(bricks.begin(), bricks.end());
  bricks.erase(std::unique(bricks.begin(), bricks.end()), bricks.end());
  const std::vector<Coord> sorted = bricks;
  std::shuffle(bricks.begin(), bricks.end(), random);

  const Grid grid(1, Vec3::Zero(), 1, bricks, std::vector<float>(bricks.size() * Grid::kBrickVoxels, 0.5f));
  for (std::int32_t i = -16; i <= 16; ++i)
    for (std::int32_t j = -16; j <= 16; ++j)
      for (std::int32_t k = -16; k <= 16; ++k) {
        const auto expected = std::lower_bound(sorted.begin(), sorted.end(), Coord{i, j, k});
        const bool there = expected != sorted.end() && *expected == Coord{i, j, k};
        EXPECT_EQ(grid.find({i, j, k}), there ? static_cast<std::size_t>(expected - sorted.begin()) : sorted.size());
      }
}

TEST(Grid, OrderWithinABrickIsThatOfAnOpenVdbLeaf) {
  std::vector<float> values(Grid::kBrickVoxels);
  for (std::size_t n = 0; n < values.size(); ++n) values[n] = static_cast<float>(n);
  const Grid grid(1, Vec3::Zero(), 1000, {{-1, 0, 2}}, values);
  EXPECT_EQ(grid.value({-8, 0, 16}), 0);
  EXPECT_EQ(grid.value({-8, 0, 17}), 1);
  EXPECT_EQ(grid.value({-8, 1, 16}), 8);
  EXPECT_EQ(grid.value({-7, 0, 16}), 64);
  EXPECT_EQ(grid.value({-1, 7, 23}), 511);
}

TEST(Grid, TheSideAwayFromBricksComesFromTheColumn) {
  std::vector<float> low(Grid::kBrickVoxels, 3), high(Grid::kBrickVoxels, 3);
  for (std::int32_t i = 0; i < 4; ++i)  // half of the columns run through the inside
    for (std::int32_t j = 0; j < 8; ++j) low[Grid::number(i, j, 7)] = high[Grid::number(i, j, 0)] = -3;
  low.insert(low.end(), high.begin(), high.end());
  const Grid grid(1, Vec3::Zero(), 3, {{0, 0, 0}, {0, 0, 9}}, low);
  EXPECT_EQ(grid.value({0, 0, 8}), -3);
  EXPECT_EQ(grid.value({3, 7, 71}), -3);
  EXPECT_EQ(grid.value({4, 0, 30}), 3);
  EXPECT_EQ(grid.value({0, 0, -1}), 3) << "below the column";
  EXPECT_EQ(grid.value({0, 0, 80}), 3) << "above the column";
  EXPECT_EQ(grid.value({0, 8, 40}), 3) << "beside the column";
  EXPECT_EQ(grid.value({2'000'000'000, -2'000'000'000, 0}), 3);
}

TEST(Grid, TheNearerBrickDecidesWhereAColumnIsInconsistent) {
  const Grid grid(1, Vec3::Zero(), 3, {{0, 0, 0}, {0, 0, 4}}, flat({-3, 3}));
  EXPECT_EQ(grid.value({0, 0, 8}), -3);
  EXPECT_EQ(grid.value({0, 0, 16}), -3);
  EXPECT_EQ(grid.value({0, 0, 24}), 3);
}

TEST(Grid, EmptyIsOutsideEverywhere) {
  const Grid grid(1, Vec3::Zero(), 2, {}, {});
  EXPECT_EQ(grid.find({0, 0, 0}), 0u);
  EXPECT_EQ(grid.value({3, 4, 5}), 2);
  EXPECT_TRUE(grid.bounds().empty());
}

TEST(Grid, SamplesThatAreNotFiniteCountAsOutside) {
  const float inf = std::numeric_limits<float>::infinity();
  std::vector<float> values(Grid::kBrickVoxels, -1);
  values[0] = std::nanf("");
  values[1] = inf;
  values[2] = -inf;
  const Grid grid(1, Vec3::Zero(), 2, {{0, 0, 0}}, values);
  for (const std::int32_t k : {0, 1, 2}) EXPECT_EQ(grid.value({0, 0, k}), 2);
  EXPECT_EQ(grid.value({0, 0, 3}), -1);
}

TEST(Grid, RejectsWhatHasNoMeaning) {
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  const std::vector<float> one(Grid::kBrickVoxels, 1);
  for (const double bad : {0.0, -1.0, nan, inf, 1e-200}) {
    EXPECT_THROW(Grid(bad, Vec3::Zero(), 1, {}, {}), InvalidInput);
    EXPECT_THROW(Grid(1, Vec3::Zero(), bad, {}, {}), InvalidInput);
  }
  EXPECT_THROW(Grid(1, Vec3::Zero(), 1e60, {}, {}), InvalidInput) << "not a float";
  EXPECT_THROW(Grid(1, Vec3(0, nan, 0), 1, {}, {}), InvalidInput);
  EXPECT_THROW(Grid(1, Vec3::Zero(), 1, {{0, 0, 0}}, {}), InvalidInput);
  EXPECT_THROW(Grid(1, Vec3::Zero(), 1, {}, one), InvalidInput);
  EXPECT_THROW(Grid(1, Vec3::Zero(), 1, {{0, 0, 1 << 28}}, one), InvalidInput);
  EXPECT_THROW(Grid(1, Vec3::Zero(), 1, {{1, 2, 3}, {0, 0, 0}, {1, 2, 3}}, flat({1, 2, 3})), InvalidInput);
}

}  // namespace
}  // namespace meniscus::field
