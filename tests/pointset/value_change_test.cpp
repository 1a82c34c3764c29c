#include <meniscus/pointset/value_change.h>

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::pointset {
namespace {

Stroke at_origin() {
  Stroke s;
  s.path = {Vec3::Zero()};
  s.radius = 1;
  return s;
}

/// s'(x) for s(x) = slope·x.
double changed(const ValueChange& change, const Vec3& x, const Vec3& slope) {
  Vec3 source = x;
  change.sources({&source, 1});
  double value = slope.dot(source);
  change.values({&x, 1}, {&value, 1});
  return value;
}

TEST(ValueChange, RaiseLowersValuesByTheWeight) {
  const ToolShape shape(at_origin());
  const Raise raise(shape, 0.2);
  for (const Vec3& x : {Vec3(0, 0, 0), Vec3(0.5, 0, 0), Vec3(2, 0, 0)})
    EXPECT_NEAR(changed(raise, x, Vec3::UnitZ()), -0.2 * shape.weight(x), 1e-15);
  EXPECT_TRUE(raise.touches(Vec3(0.5, 0, 0), Vec3::UnitZ()));
  EXPECT_FALSE(raise.touches(Vec3(2, 0, 0), Vec3::UnitZ()));
}

TEST(ValueChange, FlattenGoesToThePlaneAndSparesTheOtherSide) {
  Stroke s = at_origin();
  s.falloff.kind = Falloff::Kind::Constant;
  s.mirror = {true, false, false};
  s.path = {Vec3(2, 0, 0)};
  const ToolShape shape(s);
  const Vec3 normal = Vec3(1, 0, 1).normalized();
  const Flatten flatten(shape, Vec3(2, 0, 0), normal, 1);
  EXPECT_NEAR(changed(flatten, Vec3(2.1, 0, 0.3), Vec3(5, 6, 7)), normal.dot(Vec3(0.1, 0, 0.3)), 1e-14);
  EXPECT_NEAR(changed(flatten, Vec3(-2.1, 0, 0.3), Vec3(5, 6, 7)), normal.dot(Vec3(0.1, 0, 0.3)), 1e-14);
  EXPECT_TRUE(flatten.touches(Vec3(2, 0, 0), Vec3(1, 0, 0)));
  EXPECT_FALSE(flatten.touches(Vec3(2, 0, 0), Vec3(-1, 0, 0)));
  EXPECT_TRUE(flatten.touches(Vec3(-2, 0, 0), Vec3(-1, 0, 0)));
}

TEST(ValueChange, CarriedPlacesComeFromWhereTheyWere) {
  const ToolShape shape(at_origin());
  const Carry carry(shape, Vec3(0.05, 0, 0.02));
  const Crease crease(shape, 0, 0.1);
  for (const ValueChange* change : {static_cast<const ValueChange*>(&carry), static_cast<const ValueChange*>(&crease)}) {
    const Vec3 start(0.3, 0.2, 0);
    Vec3 back = change->carried(start);
    EXPECT_GT((back - start).norm(), 5e-3);
    change->sources({&back, 1});
    EXPECT_LT((back - start).norm(), 5e-3);  // second order in the way
  }
}

TEST(ValueChange, CreaseDrawsTowardsThePathAndRaisesIt) {
  const ToolShape shape(at_origin());
  const Crease crease(shape, 0.1, 0.2);
  EXPECT_LT(crease.carried(Vec3(0.5, 0, 0)).x(), 0.5);
  EXPECT_NEAR(changed(crease, Vec3::Zero(), Vec3::UnitZ()), -0.1, 1e-15);
}

TEST(ValueChange, EmbossTouchesWhatFacesTheLightInsideTheImage) {
  const ToolShape shape([] {
    Stroke s;
    s.tool = Stroke::Tool::Emboss;
    return s;
  }());
  const GreyImage image{4, 4, std::vector<float>(16, 0.5F)};
  const Emboss emboss(shape, image, Projection{}, 0.2);
  EXPECT_TRUE(emboss.touches(Vec3(0.2, 0.2, 5), Vec3(0, 0, 1)));
  EXPECT_FALSE(emboss.touches(Vec3(0.2, 0.2, 5), Vec3(0, 0, -1)));
  EXPECT_FALSE(emboss.touches(Vec3(0.7, 0.2, 5), Vec3(0, 0, 1)));
  EXPECT_NEAR(changed(emboss, Vec3(0.2, 0.2, 5), Vec3::Zero()), -0.1, 1e-7);
}

TEST(ValueChange, GridChangeIsWhatTheGridHasMovedSince) {
  SculptGrid grid(Box::around(Vec3::Zero(), 1), 11, {});
  std::fill(grid.load().begin(), grid.load().end(), 1.0F);
  grid.step(0.1);
  const std::vector<float> since(grid.deviation().begin(), grid.deviation().end());
  EXPECT_FALSE(GridChange(grid, since).touches(Vec3::Zero(), Vec3::UnitZ()));
  grid.step(0.1);
  const GridChange change(grid, since);
  const auto cell = grid.cell(Vec3(0.03, 0.04, 0));
  EXPECT_TRUE(change.touches(Vec3(0.03, 0.04, 0), Vec3::UnitZ()));
  EXPECT_NEAR(changed(change, Vec3(0.03, 0.04, 0), Vec3::Zero()), grid.at(cell, grid.deviation()) - grid.at(cell, since),
              1e-6);
  EXPECT_EQ(changed(change, Vec3(0, 0, 7), Vec3::Zero()), 0);
}

}  // namespace
}  // namespace meniscus::pointset
