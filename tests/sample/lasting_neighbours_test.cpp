#include <meniscus/base/random.h>
#include <meniscus/sample/lasting_neighbours.h>
#include <meniscus/sample/repulsion.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace meniscus::sample {
namespace {

/// Particles on a bumpy sheet, radii within a factor of two, with their lists.
struct Crowd {
  SurfacePoints points;
  std::vector<double> sigma;
  LastingNeighbours lists;

  explicit Crowd(int side, double scale = 1) {
    for (int a = 0; a < side; ++a)
      for (int b = 0; b < side; ++b) {
        const auto u = random_uniform(7, static_cast<std::uint64_t>(a * side + b), 0);
        points.push_back(scale * Vec3(2 * a + u[0], 2 * b + u[1], std::sin(0.5 * a)), Vec3::UnitZ());
        sigma.push_back(scale * (0.7 + 0.7 * u[2]));
      }
    lists.find(points, sigma, {});
  }
  void move(std::size_t i, const Vec3& way) {
    lists.moved(i, way);
    points.set_position(i, points.position(i) + way);
  }
  void divide(std::size_t i, const Vec3& aside) {
    points.push_back(points.position(i), points.normal(i));
    sigma[i] /= std::sqrt(2.0);
    sigma.push_back(sigma[i]);
    lists.born(i);
    move(i, -aside);
    move(points.size() - 1, aside);
  }
  void remove(std::size_t i) {
    const std::size_t last = points.size() - 1;
    points.set_position(i, points.position(last));
    sigma[i] = sigma[last];
    points.resize(last);
    sigma.pop_back();
    lists.died(i);
  }
};

/// Every pair that feels each other is listed, at both ends, once, and nobody lists itself or one that is gone.
void expect_complete(const Crowd& c) {
  const std::size_t n = c.points.size();
  std::size_t felt = 0;
  for (std::uint32_t i = 0; i < n; ++i) {
    const auto list = c.lists.of(i);
    const std::set<std::uint32_t> listed(list.begin(), list.end());
    EXPECT_EQ(listed.size(), list.size()) << "twice in the list of " << i;
    EXPECT_EQ(listed.count(i), 0u);
    for (std::uint32_t j = 0; j < n; ++j) {
      const auto other = c.lists.of(j);
      EXPECT_EQ(listed.count(j), static_cast<std::size_t>(std::count(other.begin(), other.end(), i))) << i << " " << j;
      if (i == j ||
          (c.points.position(i) - c.points.position(j)).norm() > kRepulsionReach * std::max(c.sigma[i], c.sigma[j]))
        continue;
      EXPECT_EQ(listed.count(j), 1u) << i << " misses " << j;
      ++felt;
    }
    EXPECT_TRUE(listed.empty() || *listed.rbegin() < n);
  }
  EXPECT_GT(felt, 5 * n);
}

Vec3 random_way(std::size_t i, std::uint64_t step, double length) {
  const auto u = random_uniform(11, i, step);
  return length * (2 * Vec3(u[0], u[1], u[2]) - Vec3::Ones()).normalized();
}

TEST(LastingNeighbours, CompleteWhileMotionIsWithinTheSkin) {
  for (const double scale : {0.01, 1.0, 1000.0}) {
    Crowd c(14, scale);
    for (std::size_t i = 0; i < c.points.size(); ++i) c.move(i, random_way(i, 0, 0.19 * c.sigma[i]));
    EXPECT_TRUE(c.lists.mend(c.points, c.sigma, {}));
    expect_complete(c);
  }
}

TEST(LastingNeighbours, TheNewbornInheritTheListsOfTheirParents) {
  Crowd c(14);
  for (std::size_t i = 0; i < 196; i += 5) c.divide(i, random_way(i, 0, 0.5 * c.sigma[i]));
  // Parents of a second generation, next to each other.
  for (std::size_t i = 196; i < 200; ++i) c.divide(i, random_way(i, 0, 0.1 * c.sigma[i]));
  expect_complete(c);
}

TEST(LastingNeighbours, TheDeadLeaveNoTrace) {
  Crowd c(14);
  c.remove(195);
  for (const std::size_t i : {180u, 100u, 99u, 98u, 3u, 0u}) c.remove(i);
  c.divide(5, {0.2, 0, 0});
  c.remove(c.points.size() - 1);
  c.divide(7, {0.2, 0, 0});
  c.remove(7);
  expect_complete(c);
}

TEST(LastingNeighbours, AFastParticleFindsNewNeighboursOnItsWay) {
  Crowd c(40);
  const std::size_t runner = 90;
  for (int step = 0; step < 60; ++step) {
    c.move(runner, Vec3(0.3, 0.2, 0));
    ASSERT_TRUE(c.lists.mend(c.points, c.sigma, {})) << "step " << step;
    // Within the tear that is tolerated, only the rim may be missed.
    const auto list = c.lists.of(runner);
    for (std::uint32_t j = 0; j < c.points.size(); ++j)
      if (j != runner &&
          (c.points.position(runner) - c.points.position(j)).norm() < 3.2 * std::max(c.sigma[runner], c.sigma[j]))
        EXPECT_EQ(std::count(list.begin(), list.end(), j), 1) << "step " << step;
  }
}

TEST(LastingNeighbours, TooMuchMotionAsksForAllListsAnew) {
  Crowd few(14), far(14), never(14);
  for (std::size_t i = 0; i < 5; ++i) few.move(40 * i, Vec3(0.6 * few.sigma[40 * i], 0, 0));
  EXPECT_FALSE(few.lists.mend(few.points, few.sigma, {})) << "more than one in a hundred beyond the skin";
  far.move(60, Vec3(0, 0, 10));
  EXPECT_FALSE(far.lists.mend(far.points, far.sigma, {}));
  EXPECT_TRUE(never.lists.mend(never.points, never.sigma, {}));
  never.lists.clear();
  EXPECT_FALSE(never.lists.mend(never.points, never.sigma, {}));
}

}  // namespace
}  // namespace meniscus::sample
