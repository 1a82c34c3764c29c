#include <meniscus/band/velocity_grid.h>

#include <gtest/gtest.h>

namespace meniscus::band {
namespace {

struct Lattice {
  std::vector<Vec3> x, v;
  std::vector<double> weight;
};

template <class Velocity>
Lattice lattice(int side, double spacing, const Velocity& velocity) {
  Lattice out;
  for (int n = 0; n < side * side * side; ++n) {
    out.x.push_back(spacing * Vec3(n / (side * side), n / side % side, n % side));
    out.v.push_back(velocity(out.x.back()));
  }
  out.weight.assign(out.x.size(), 1);
  return out;
}

TEST(VelocityGrid, ACommonVelocityIsEverybodys) {
  for (const double scale : {1.0, 0.01, 1000.0}) {
    const Lattice l = lattice(8, scale, [&](const Vec3&) { return Vec3(scale * Vec3(1, -2, 3)); });
    const VelocityGrid grid(l.x, l.v, l.weight, 2 * scale);
    for (const Vec3& x : {Vec3(3.3, 4.1, 2.7), Vec3(0, 0, 0), Vec3(7.9, 7.9, 7.9)})
      EXPECT_LT((grid.at(scale * x) - scale * Vec3(1, -2, 3)).norm(), 1e-12 * scale);
  }
}

TEST(VelocityGrid, ALinearVelocityStaysSoInTheMiddle) {
  // B-splines average over symmetric neighbourhoods: on an even lattice what is linear stays what it is.
  const auto turning = [](const Vec3& x) { return Vec3(x.y(), -x.x(), 0.5 * x.z()); };
  const Lattice l = lattice(24, 0.5, turning);
  const VelocityGrid grid(l.x, l.v, l.weight, 1);
  for (const Vec3& x : {Vec3(6, 6, 6), Vec3(5.3, 6.4, 5.9)}) EXPECT_LT((grid.at(x) - turning(x)).norm(), 0.02);
}

TEST(VelocityGrid, ScatterAveragesOut) {
  int sign = 1;
  const Lattice l = lattice(16, 0.5, [&](const Vec3&) { return Vec3(1, (sign = -sign) * 10.0, 0); });
  const VelocityGrid grid(l.x, l.v, l.weight, 2);
  EXPECT_NEAR(grid.at({4, 4, 4}).x(), 1, 1e-12);
  EXPECT_LT(std::abs(grid.at({4.1, 3.9, 4})[1]), 0.5);
}

TEST(VelocityGrid, CountsByWeightAndIsZeroWhereNobodyIs) {
  const std::vector<Vec3> x(3, Vec3(0.2, 0.1, 0)), v{{1, 0, 0}, {4, 0, 0}, {100, 0, 0}};
  const std::vector<double> weight{1, 0.5, 0};
  const VelocityGrid grid(x, v, weight, 1);
  EXPECT_NEAR(grid.at({0.3, 0, 0}).x(), 2, 1e-12);
  EXPECT_EQ(grid.at({9, 0, 0}), Vec3(0, 0, 0));
  EXPECT_EQ(VelocityGrid({}, {}, {}, 1).at({0, 0, 0}), Vec3(0, 0, 0));
}

}  // namespace
}  // namespace meniscus::band
