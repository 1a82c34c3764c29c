#include <meniscus/band/particle_cells.h>
#include <meniscus/base/random.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <set>

namespace meniscus::band {
namespace {

std::vector<Vec3> scattered(std::size_t count, double scale) {
  std::vector<Vec3> out;
  for (std::size_t i = 0; i < count; ++i) {
    const auto u = random_uniform(12, i, 0);
    out.push_back(scale * Vec3(4 * u[0], 3 * u[1] - 7, 2 * u[2]));
  }
  return out;
}

std::set<std::uint32_t> found(const ParticleCells& cells, const Box& box) {
  std::set<std::uint32_t> out;
  cells.for_runs(box, [&](std::size_t begin, std::size_t end) {
    for (std::size_t m = begin; m < end; ++m) EXPECT_TRUE(out.insert(cells.order()[m]).second) << "told twice";
  });
  return out;
}

TEST(ParticleCells, FindEveryPointWithinACellsEdge) {
  for (const double scale : {1.0, 0.01, 1000.0}) {
    const std::vector<Vec3> points = scattered(3000, scale);
    const double cell = 0.3 * scale;
    const ParticleCells cells(points, cell);
    for (std::size_t q = 0; q < 50; ++q) {
      const Box box = Box::around(points[17 * q], 0.02 * scale * static_cast<double>(q));
      const auto some = found(cells, box);
      std::size_t near = 0;
      for (std::uint32_t i = 0; i < points.size(); ++i) {
        const Vec3 gap = (box.min - points[i]).cwiseMax(points[i] - box.max).cwiseMax(0);
        if (gap.norm() > cell) continue;
        ++near;
        EXPECT_TRUE(some.contains(i));
      }
      EXPECT_GE(some.size(), near);
      // And not many more: those of the cells that the box grown by a cell meets.
      const Vec3 reach = box.size() + Vec3::Constant(4 * cell);
      for (const std::uint32_t i : some) EXPECT_TRUE(Box(box).padded(2 * cell).contains(points[i])) << reach.transpose();
    }
  }
}

TEST(ParticleCells, HoldEveryPointOnceInBoxesOfTheirSize) {
  const std::vector<Vec3> points = scattered(500, 1);
  const ParticleCells cells(points, 0.4);
  std::vector<std::uint32_t> order = cells.order();
  std::sort(order.begin(), order.end());
  std::vector<std::uint32_t> all(points.size());
  std::iota(all.begin(), all.end(), 0u);
  EXPECT_EQ(order, all);
  for (const Vec3& p : points)
    EXPECT_TRUE(std::ranges::any_of(cells.boxes(), [&](const Box& b) { return b.padded(1e-9).contains(p); }));
  for (const Box& b : cells.boxes()) {
    EXPECT_NEAR(b.size().maxCoeff(), 0.4, 1e-9);
    EXPECT_TRUE(std::ranges::any_of(points, [&](const Vec3& p) { return b.padded(1e-9).contains(p); }));
  }
}

TEST(ParticleCells, AStrayIsLeftOutAndDecidesNothing) {
  std::vector<Vec3> points = scattered(400, 1);
  const auto before = found(ParticleCells(points, 0.3), Box::around(points[0], 0.1));
  points.emplace_back(1e9, 0, 0);
  points.emplace_back(0, std::numeric_limits<double>::infinity(), 0);
  const ParticleCells cells(points, 0.3);
  EXPECT_EQ(cells.left_out(), 2u);
  EXPECT_EQ(cells.order().size(), 400u);
  EXPECT_EQ(found(cells, Box::around(points[0], 0.1)), before);
}

TEST(ParticleCells, NoPointsAndPointsInOnePlace) {
  const ParticleCells none(std::vector<Vec3>{}, 1);
  EXPECT_TRUE(none.boxes().empty());
  EXPECT_TRUE(found(none, Box::around(Vec3::Zero(), 10)).empty());
  const ParticleCells together(std::vector<Vec3>(64, Vec3(1, 2, 3)), 0.5);
  EXPECT_EQ(together.boxes().size(), 1u);
  EXPECT_EQ(found(together, Box::around({1.2, 2, 3}, 0)).size(), 64u);
  EXPECT_TRUE(found(together, Box::around({9, 2, 3}, 0)).empty());
}

}  // namespace
}  // namespace meniscus::band
