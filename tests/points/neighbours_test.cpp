#include <meniscus/points/neighbours.h>

#include <meniscus/base/error.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace meniscus::points {
namespace {

std::vector<Vec3> random_points(std::size_t count, double scale, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(-scale, scale);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i) points.emplace_back(u(random), u(random), u(random));
  return points;
}

/// Points of a lattice: full of equal distances.
std::vector<Vec3> lattice(int n) {
  std::vector<Vec3> points;
  for (int i = 0; i < n * n * n; ++i) points.emplace_back(i % n, i / n % n, i / n / n);
  return points;
}

std::vector<Neighbour> by_looking_at_all(std::span<const Vec3> points, const Vec3& place) {
  std::vector<Neighbour> all;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 d = place - points[i];
    if (points[i].allFinite()) all.push_back({static_cast<std::uint32_t>(i), d.x() * d.x() + d.y() * d.y() + d.z() * d.z()});
  }
  std::sort(all.begin(), all.end(), [](const Neighbour& a, const Neighbour& b) {
    return std::pair(a.squared_distance, a.index) < std::pair(b.squared_distance, b.index);
  });
  return all;
}

TEST(Neighbours, NearestAreThoseThatLookingAtAllFinds) {
  for (const double scale : {0.01, 1.0, 1000.0})
    for (const bool regular : {false, true}) {
      std::vector<Vec3> points = regular ? lattice(9) : random_points(1000, 1);
      for (Vec3& p : points) p *= scale;
      points.push_back(scale * Vec3(1e6, 0, 0));  // astray
      const NeighbourSearch search(points);
      std::vector<Neighbour> found;
      for (const Vec3& unit : random_points(100, 3)) {
        const Vec3 place = regular ? Vec3(scale * (2 * unit).array().round().matrix() * 0.5) : Vec3(scale * unit);
        std::vector<Neighbour> expected = by_looking_at_all(points, place);
        for (const std::size_t count : {1u, 6u, 50u}) {
          search.nearest(place, count, found);
          EXPECT_TRUE(std::equal(found.begin(), found.end(), expected.begin(), expected.begin() + static_cast<long>(count)));
        }
        const double radius = std::sqrt(expected[30].squared_distance);
        search.within(place, radius, found);
        const auto end = std::find_if(expected.begin(), expected.end(),
                                      [&](const Neighbour& n) { return n.squared_distance > radius * radius; });
        EXPECT_TRUE(std::equal(found.begin(), found.end(), expected.begin(), end));
      }
    }
}

TEST(Neighbours, FewAndCoincidentPoints) {
  std::vector<Neighbour> found;
  NeighbourSearch({}).nearest(Vec3::Zero(), 3, found);
  EXPECT_TRUE(found.empty());
  const std::vector<Vec3> same(1000, Vec3(1, 2, 3));
  const NeighbourSearch search(same);
  search.nearest(Vec3::Zero(), 3, found);
  ASSERT_EQ(found.size(), 3u);
  for (std::uint32_t i = 0; i < 3; ++i) EXPECT_EQ(found[i], (Neighbour{i, 14}));
  search.nearest(Vec3::Zero(), 5000, found);
  EXPECT_EQ(found.size(), 1000u);
  search.nearest(Vec3::Zero(), 0, found);
  EXPECT_TRUE(found.empty());
  search.within(Vec3(1, 2, 3), 0, found);
  EXPECT_EQ(found.size(), 1000u);
  search.within(Vec3(1, 2, 3), -1, found);
  EXPECT_TRUE(found.empty());
}

TEST(Neighbours, WhatIsNotFiniteIsNeverFound) {
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  const std::vector<Vec3> points{{nan, 0, 0}, {1, 0, 0}, {0, inf, 0}, {3, 0, 0}, {1e200, 0, 0}};
  const NeighbourSearch search(points);
  std::vector<Neighbour> found;
  search.nearest(Vec3::Zero(), 2, found);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].index, 1u);
  EXPECT_EQ(found[1].index, 3u);
  for (const Vec3& place : {Vec3(nan, 0, 0), Vec3(0, -inf, 0)}) {
    search.nearest(place, 2, found);
    EXPECT_TRUE(found.empty());
    search.within(place, 10, found);
    EXPECT_TRUE(found.empty());
  }
}

TEST(Neighbours, ListsLeaveOutThePointItselfButNotItsTwin) {
  const std::vector<Vec3> points{{0, 0, 0}, {0, 0, 0}, {1, 0, 0}, {5, 0, 0}};
  const NeighbourLists nearest = nearest_neighbours(points, 2), near = neighbours_within(points, 1);
  ASSERT_EQ(nearest.size(), 4u);
  EXPECT_TRUE(std::ranges::equal(nearest.of(0), std::vector<std::uint32_t>{1, 2}));
  EXPECT_TRUE(std::ranges::equal(nearest.of(1), std::vector<std::uint32_t>{0, 2}));
  EXPECT_TRUE(std::ranges::equal(nearest.of(3), std::vector<std::uint32_t>{2, 0}));
  EXPECT_TRUE(std::ranges::equal(near.of(2), std::vector<std::uint32_t>{0, 1}));
  EXPECT_TRUE(near.of(3).empty());
  EXPECT_EQ(nearest_neighbours({}, 3).size(), 0u);
  EXPECT_THROW(neighbours_within(points, -1), InvalidInput);
  EXPECT_THROW(neighbours_within(points, std::nan("")), InvalidInput);
}

TEST(Neighbours, ManyTwinsStillGiveFullLists) {
  const std::vector<Vec3> points(40, Vec3(1, 1, 1));
  const NeighbourLists lists = nearest_neighbours(points, 5);
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_EQ(lists.of(i).size(), 5u);
}

TEST(Neighbours, SameListsForAnyThreadCount) {
  const std::vector<Vec3> points = lattice(16);
  const auto with = [&](int threads) {
    return nearest_neighbours(points, 9, RunControl({.threads = threads, .seed = 0, .on_progress = {}}));
  };
  const NeighbourLists one = with(1);
  for (const int threads : {2, 3, 5, 8}) {
    const NeighbourLists many = with(threads);
    EXPECT_EQ(one.begin, many.begin);
    EXPECT_EQ(one.index, many.index);
  }
}

}  // namespace
}  // namespace meniscus::points
