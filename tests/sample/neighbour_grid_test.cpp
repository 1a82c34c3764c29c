#include <meniscus/base/random.h>
#include <meniscus/sample/neighbour_grid.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace meniscus::sample {
namespace {

struct Points {
  field::PositionBatch x;
  std::vector<double> reach;
};

/// n points on a bumpy sheet; reaches spread evenly in logarithm over a factor `spread`.
Points sheet(std::size_t n, double spread, double scale = 1) {
  Points p{field::PositionBatch(n), std::vector<double>(n)};
  for (std::size_t i = 0; i < n; ++i) {
    const auto u = random_uniform(3, i, 0);
    p.x.set(i, scale * Vec3(u[0] - 0.5, 0.1 * std::sin(9 * u[1]), u[1] - 0.5));
    p.reach[i] = scale * 0.02 * std::pow(spread, -u[2]);
  }
  return p;
}

std::vector<std::set<std::uint32_t>> brute_force(const Points& p) {
  std::vector<std::set<std::uint32_t>> near(p.reach.size());
  for (std::uint32_t i = 0; i < near.size(); ++i)
    for (std::uint32_t j = 0; j < near.size(); ++j)
      if (i != j && (p.x.view()[i] - p.x.view()[j]).norm() < std::max(p.reach[i], p.reach[j])) near[i].insert(j);
  return near;
}

void expect_exact(const Points& p) {
  const Neighbours found = find_neighbours(p.x.view(), p.reach);
  const auto wanted = brute_force(p);
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const auto list = found.of(i);
    EXPECT_EQ(std::set<std::uint32_t>(list.begin(), list.end()), wanted[i]) << "particle " << i;
    EXPECT_EQ(list.size(), wanted[i].size()) << "a neighbour twice at " << i;
  }
}

TEST(NeighbourGrid, FindsExactlyWhatAllPairsFind) {
  for (const double spread : {1.0, 3.0, 100.0, 1e4}) expect_exact(sheet(1500, spread));
}

TEST(NeighbourGrid, WorksAtAnyScale) {
  expect_exact(sheet(500, 100, 0.01));
  expect_exact(sheet(500, 100, 1000));
}

TEST(NeighbourGrid, DegenerateSets) {
  expect_exact(sheet(0, 1));
  expect_exact(sheet(1, 1));
  Points same = sheet(50, 10);
  for (std::size_t i = 0; i < 50; ++i) same.x.set(i, Vec3(1, 2, 3));
  expect_exact(same);
  // One stray far away must neither be found nor cost a dense grid.
  Points stray = sheet(500, 2);
  stray.x.set(7, Vec3(1e9, -1e9, 1e9));
  expect_exact(stray);
  Points one_large = sheet(500, 1);
  one_large.reach[3] = 5;
  expect_exact(one_large);
}

TEST(NeighbourGrid, SameListsForAnyThreadCount) {
  const Points p = sheet(5000, 30);
  const Neighbours one = find_neighbours(p.x.view(), p.reach, RunControl({.threads = 1, .seed = 0, .on_progress = {}}));
  for (const int threads : {2, 3, 5, 8}) {
    const Neighbours many =
        find_neighbours(p.x.view(), p.reach, RunControl({.threads = threads, .seed = 0, .on_progress = {}}));
    EXPECT_EQ(one.index, many.index);
    EXPECT_EQ(one.first, many.first);
  }
}

TEST(NeighbourGrid, SpatialOrderIsAPermutation) {
  const Points p = sheet(1000, 1);
  std::vector<std::uint32_t> order = spatial_order(p.x.view(), 0.02);
  std::sort(order.begin(), order.end());
  for (std::uint32_t i = 0; i < order.size(); ++i) EXPECT_EQ(order[i], i);
}

}  // namespace
}  // namespace meniscus::sample
