#include <meniscus/pointset/conform.h>

#include <meniscus/pointset/local_fit.h>

#include "clouds.h"

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::pointset {
namespace {

ToolShape everywhere() {
  Stroke s;
  s.tool = Stroke::Tool::Refine;
  return ToolShape(s);
}

TEST(Conform, ARaisedSphereIsALargerOne) {
  for (const double scale : {0.01, 1.0, 1000.0}) {
    const PointSetField field(fit(test::sphere(3000, scale)));
    const ToolShape shape = everywhere();
    const auto found = conform(field, Raise(shape, 0.03 * scale));
    ASSERT_EQ(found.size(), 3000u);
    for (const Conformed& c : found) {
      EXPECT_FALSE(c.lost);
      EXPECT_NEAR(c.position.norm(), 1.03 * scale, 2e-4 * scale);
      EXPECT_LT(test::degrees_between(c.normal, c.position), 0.5);
    }
  }
}

TEST(Conform, ACarriedSphereIsElsewhereAndItsPointsWithIt) {
  const PointSet set = fit(test::sphere(3000));
  const ToolShape shape = everywhere();
  const Vec3 way(0.2, -0.1, 0.3);  // far beyond a domain: points begin where they are carried to
  for (const Conformed& c : conform(PointSetField(set), Carry(shape, way))) {
    EXPECT_FALSE(c.lost);
    EXPECT_LT((c.position - set.position(c.index) - way).norm(), 2e-3);
  }
}

TEST(Conform, PointsWithoutASurfaceAreLost) {
  const PointSetField field(fit(test::sphere(3000)));
  const ToolShape shape = everywhere();
  for (const Conformed& c : conform(field, Raise(shape, -3))) EXPECT_TRUE(c.lost);
}

}  // namespace
}  // namespace meniscus::pointset
