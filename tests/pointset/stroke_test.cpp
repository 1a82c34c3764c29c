#include <meniscus/pointset/stroke.h>

#include <meniscus/base/error.h>

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::pointset {
namespace {

Stroke inflate() {
  Stroke s;
  s.tool = Stroke::Tool::Inflate;
  s.path = {Vec3(1, 0, 0)};
  s.radius = 0.5;
  s.strength = 0.1;
  return s;
}

TEST(Falloff, GoesFromOneToZeroAndNeverRises) {
  using Kind = Falloff::Kind;
  for (const Kind kind : {Kind::Gaussian, Kind::Constant, Kind::Spherical, Kind::Smooth}) {
    const Falloff falloff{kind, {}};
    EXPECT_EQ(falloff.at(0), 1);
    EXPECT_EQ(falloff.at(1), 0);
    EXPECT_EQ(falloff.at(2), 0);
    for (double r = 0; r < 1; r += 0.01) EXPECT_LE(falloff.at(r + 0.01), falloff.at(r));
  }
  EXPECT_EQ((Falloff{Kind::Constant, {}}.at(0.7)), 1);
  EXPECT_NEAR((Falloff{Kind::Spherical, {}}.at(0.6)), 0.8, 1e-15);
  EXPECT_NEAR((Falloff{Kind::Custom, {0, 2, 1}}.at(0.25)), 1, 1e-15);
  EXPECT_NEAR((Falloff{Kind::Custom, {0, 2, 1}}.at(0.75)), 1.5, 1e-15);
}

TEST(ToolShape, MeasuresFromTheNearestPlaceOfItsPath) {
  Stroke s = inflate();
  s.path = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0)};
  s.falloff.kind = Falloff::Kind::Spherical;
  const ToolShape shape(s);
  const auto reach = shape.at(Vec3(0.4, 0.3, 0));
  EXPECT_NEAR(reach.weight, 0.8, 1e-14);
  EXPECT_LT((reach.nearest - Vec3(0.4, 0, 0)).norm(), 1e-14);
  EXPECT_EQ(shape.weight(Vec3(1.3, 0.5, 0.41)), 0);
  EXPECT_TRUE(shape.bounds().contains(Vec3(1.5, 1.5, 0.5)));
}

TEST(ToolShape, IsMirroredWithEqualWeights) {
  Stroke s = inflate();
  s.mirror = {true, false, true};
  s.path = {Vec3(1, 0.2, 0.7)};
  const ToolShape shape(s);
  const Vec3 p(0.8, 0.1, 0.6);
  for (const Vec3& signs : {Vec3(1, 1, 1), Vec3(-1, 1, 1), Vec3(1, 1, -1), Vec3(-1, 1, -1)}) {
    EXPECT_EQ(shape.weight(p.cwiseProduct(signs)), shape.weight(p));
    EXPECT_EQ(shape.at(p.cwiseProduct(signs)).signs, signs);
  }
  EXPECT_EQ(shape.weight(Vec3(0.8, -0.6, 0.6)), 0);
}

TEST(ToolShape, EndsAtTheRegion) {
  Stroke s = inflate();
  s.region = Box{Vec3(1, -1, -1), Vec3(2, 1, 1)};
  const ToolShape shape(s);
  EXPECT_GT(shape.weight(Vec3(1.01, 0, 0)), 0.9);
  EXPECT_EQ(shape.weight(Vec3(0.99, 0, 0)), 0);
}

TEST(Stroke, NamesGoBothWays) {
  for (const char* name : {"force", "inflate", "smooth", "flatten", "crease", "drag", "emboss", "refine"}) {
    const auto tool = tool_named(name);
    ASSERT_TRUE(tool);
    EXPECT_EQ(name_of(*tool), name);
  }
  EXPECT_FALSE(tool_named("hammer"));
}

TEST(Stroke, WithoutMeaningIsRejected) {
  EXPECT_NO_THROW(check(inflate()));
  const auto rejected = [](auto change) {
    Stroke s = inflate();
    change(s);
    EXPECT_THROW(check(s), InvalidInput);
  };
  rejected([](Stroke& s) { s.path.clear(); });
  rejected([](Stroke& s) { s.path[0].x() = std::nan(""); });
  rejected([](Stroke& s) { s.radius = 0; });
  rejected([](Stroke& s) { s.strength = INFINITY; });
  rejected([](Stroke& s) { s.tool = Stroke::Tool::Smooth, s.strength = 1.5; });
  rejected([](Stroke& s) { s.tool = Stroke::Tool::Drag; });
  rejected([](Stroke& s) { s.tool = Stroke::Tool::Emboss; });
  rejected([](Stroke& s) { s.tool = Stroke::Tool::Refine; });
  rejected([](Stroke& s) { s.tool = Stroke::Tool::Force, s.seconds = 0; });
  rejected([](Stroke& s) { s.tool = Stroke::Tool::Force, s.voxels = 3; });
  rejected([](Stroke& s) { s.falloff = {Falloff::Kind::Custom, {1}}; });
  rejected([](Stroke& s) { s.region = Box{}; });
}

}  // namespace
}  // namespace meniscus::pointset
