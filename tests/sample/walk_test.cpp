#include <meniscus/sample/walk.h>

#include "surfaces.h"

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::sample {
namespace {

TEST(Walk, AGreatCircleEndsAtItsLength) {
  for (const double scale : {0.01, 1.0, 1000.0}) {
    SurfacePoints p;
    p.push_back({scale, 0, 0}, Vec3::UnitX());
    const std::vector<Vec3> quarter{Vec3(0, 0.5 * 3.14159265358979 * scale, 0)};
    const Box box = Box::around(Vec3::Zero(), 2 * scale);
    const auto arrived = walk(*test::sphere(scale), box, quarter, 24, 1e-12 * scale, p);
    EXPECT_EQ(arrived[0], 1);
    // Each part is a chord's length along the tangent: arctan(h) instead of h, off by h²/3.
    EXPECT_LT((p.position(0) - Vec3(0, scale, 0)).norm(), 0.003 * scale);
    EXPECT_NEAR(p.normal(0).y(), 1, 1e-4);
  }
}

TEST(Walk, GoesAroundTheRimOfAThinBody) {
  const auto plate = field::ellipsoid(test::at(0, 0, 0), test::at(1, 1, 0.02));
  SurfacePoints p;
  p.push_back({0.9, 0, 0.02 * std::sqrt(1 - 0.81)}, Vec3::UnitZ());
  const std::vector<Vec3> out{Vec3(0.2, 0, 0)};
  const auto arrived = walk(*plate, Box::around(Vec3::Zero(), 2), out, 64, 1e-9, p);
  EXPECT_EQ(arrived[0], 1);
  EXPECT_LT(p.z[0], 0);            // on the other side,
  EXPECT_NEAR(p.x[0], 0.9, 0.03);  // as far from the rim as it started
}

TEST(Walk, WithoutASurfaceNothingArrives) {
  SurfacePoints p;
  p.push_back({0, 0, 0}, Vec3::UnitX());
  const test::FunctionField nothing([](const Vec3&, double) { return test::FunctionField::Jet{.f = 1}; });
  const std::vector<Vec3> offset{Vec3(0, 0.1, 0)};
  EXPECT_EQ(walk(nothing, Box::around(Vec3::Zero(), 1), offset, 2, 1e-9, p)[0], 0);
}

}  // namespace
}  // namespace meniscus::sample
