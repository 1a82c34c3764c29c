#include <meniscus/render/color_map.h>

#include <gtest/gtest.h>

#include <limits>

namespace meniscus::render {
namespace {

TEST(ColorMap, SequentialLightnessRisesEvenly) {
  const double first = lightness(color_of(ColorMap::Sequential, 0));
  const double last = lightness(color_of(ColorMap::Sequential, 1));
  EXPECT_LT(first, 0.35);
  EXPECT_GT(last, 0.88);
  for (int i = 0; i <= 100; ++i) {
    const double t = i / 100.0;
    // Even to half a percent: no channel is clipped by the gamut.
    EXPECT_NEAR(lightness(color_of(ColorMap::Sequential, t)), first + (last - first) * t, 5e-3) << t;
  }
}

TEST(ColorMap, DivergingIsBrightestInTheMiddleAndBalanced) {
  const auto at = [](double t) { return lightness(color_of(ColorMap::Diverging, t)); };
  for (int i = 1; i <= 50; ++i) {
    const double t = i / 100.0;
    EXPECT_GT(at(t), at(t - 0.01));
    EXPECT_NEAR(at(0.5 - t), at(0.5 + t), 0.02);
  }
  EXPECT_GT(color_of(ColorMap::Diverging, 0).z(), color_of(ColorMap::Diverging, 0).x());
  EXPECT_GT(color_of(ColorMap::Diverging, 1).x(), color_of(ColorMap::Diverging, 1).z());
}

TEST(ColorMap, ClampsAndMarksNan) {
  EXPECT_EQ(color_of(ColorMap::Sequential, -3), color_of(ColorMap::Sequential, 0));
  EXPECT_EQ(color_of(ColorMap::Sequential, 3), color_of(ColorMap::Sequential, 1));
  EXPECT_EQ(color_of(ColorMap::Sequential, std::numeric_limits<double>::quiet_NaN()), Vec3(0.2, 0.2, 0.2));
}

}  // namespace
}  // namespace meniscus::render
