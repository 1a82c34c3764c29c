#include <meniscus/sample/evenness.h>
#include <meniscus/sample/surface_cell.h>

#include "surfaces.h"

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::sample {
namespace {

/// A hexagonal lattice with spacing s on the plane z = 0, lines parallel to x, that tiles the box of `columns` × `rows`.
struct Lattice {
  SurfacePoints points;
  Box box;
  Lattice(double s, int columns, int rows) {
    const double h = s * std::sqrt(3.0) / 2;
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < columns; ++c) points.push_back({s * (c + (r % 2 ? 0.75 : 0.25)), h * (r + 0.5), 0}, Vec3::UnitZ());
    box = {Vec3(0, 0, -1), Vec3(s * columns, h * rows, 1)};
  }
};

TEST(Evenness, HexagonalLatticeIsPerfect) {
  for (const double s : {0.01, 1.0, 1000.0}) {
    const Lattice l(s, 12, 12);
    const auto plane = field::plane(test::at(0, 0, 0), test::at(0, 0, 1));
    const Evenness e = evenness(*plane, l.box, l.points, std::vector<double>(l.points.size(), s));
    EXPECT_EQ(e.count, 144u);
    EXPECT_EQ(e.components, 1u);
    EXPECT_NEAR(e.area, 144 * std::sqrt(3.0) / 2 * s * s, 1e-9 * e.area);
    EXPECT_NEAR(e.packing, 1, 1e-9);
    EXPECT_NEAR(e.cv, 0, 1e-7);
    EXPECT_EQ(e.max_distance, 0);
    EXPECT_EQ(e.open, 0u);
  }
}

TEST(Evenness, SeesAHoleAndAPair) {
  Lattice l(1, 12, 12);
  const auto plane = field::plane(test::at(0, 0, 0), test::at(0, 0, 1));
  // Move one point of the middle next to one in its row: a vacancy of radius 1 remains.
  l.points.x[6 * 12 + 5] += 3.7;
  const Evenness e = evenness(*plane, l.box, l.points, std::vector<double>(144, 1.0));
  EXPECT_NEAR(e.packing, 0.3, 1e-9);
  EXPECT_NEAR(e.cover, std::sqrt(3.0), 1e-9);
  EXPECT_GT(e.cv, 0.05);
}

TEST(SurfaceCell, OfASquareLatticeIsASquare) {
  SurfacePoints p;
  for (int y = -2; y <= 2; ++y)
    for (int x = -2; x <= 2; ++x) p.push_back(Vec3(x, y, 0), Vec3::UnitZ());
  const std::vector<double> spacing(p.size(), 1.2);
  const Neighbours near = cell_neighbours(p, spacing);
  SurfaceCell cell;
  cell.build(p, 12, near.of(12), 1.5, Box::everywhere());
  EXPECT_NEAR(cell.area(), 1, 1e-12);
  EXPECT_NEAR(cell.nearest(), 1, 1e-12);
  EXPECT_NEAR(cell.farthest(), std::sqrt(0.5), 1e-12);
  EXPECT_FALSE(cell.open());
  cell.build(p, 0, near.of(0), 1.5, Box::everywhere());
  EXPECT_TRUE(cell.open());
}

TEST(SurfaceCell, IgnoresTheOtherSideOfASheet) {
  SurfacePoints p;
  for (int y = -2; y <= 2; ++y)
    for (int x = -2; x <= 2; ++x) {
      p.push_back(Vec3(x, y, 0.1), Vec3::UnitZ());
      p.push_back(Vec3(x + 0.3, y + 0.2, -0.1), -Vec3::UnitZ());
    }
  const std::vector<double> spacing(p.size(), 1.2);
  SurfaceCell cell;
  cell.build(p, 24, cell_neighbours(p, spacing).of(24), 1.5, Box::everywhere());
  EXPECT_NEAR(cell.area(), 1, 1e-12);
  EXPECT_NEAR(cell.nearest(), 1, 1e-12);
}

TEST(Evenness, NoPointsIsZeroEverywhere) {
  const auto sphere = test::sphere();
  const Evenness e = evenness(*sphere, Box::around(Vec3::Zero(), 2), {}, {});
  EXPECT_EQ(e.count, 0u);
  EXPECT_EQ(e.area, 0);
}

}  // namespace
}  // namespace meniscus::sample
