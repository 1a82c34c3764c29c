#include "support.h"

#include <meniscus/band/morph.h>
#include <meniscus/base/error.h>
#include <meniscus/field/combine.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace meniscus::band {
namespace {

MorphOptions settings(double scale = 1) {
  MorphOptions o;
  o.voxel = 0.5 * scale;
  o.frames = 13;
  return o;
}

/// All frames' reports.
std::vector<MorphReport> run(Morph& morph, int frames) {
  std::vector<MorphReport> reports;
  for (int f = 0; f < frames; ++f) reports.push_back(morph.next());
  return reports;
}

TEST(Morph, ASphereBecomesABox) {
  for (const double scale : {1.0, 0.01, 1000.0}) {
    const auto a = field::sphere({0, 0, 0}, 6 * scale);
    const auto b = field::box({1 * scale, 0, 0}, {16 * scale, 12 * scale, 8 * scale});
    Morph morph(*a, *b, settings(scale));
    const auto reports = run(morph, 13);
    EXPECT_NEAR(reports.front().volume / std::pow(scale, 3), 4.0 / 3 * std::numbers::pi * 216, 5);
    EXPECT_NEAR(reports.back().volume / std::pow(scale, 3) / (16 * 12 * 8), 1, 0.01);
    EXPECT_LT(reports.back().farthest, 0.5);  // at the box's edges and corners
    EXPECT_THROW(morph.next(), InvalidInput);
  }
}

TEST(Morph, TopologyIsFree) {
  // A ball becomes a ring.
  const auto a = field::sphere({0, 0, 0}, 6);
  const auto b = field::torus({0, 0, 0}, {0, 1, 0}, 8, 3);
  Morph morph(*a, *b, settings());
  const auto reports = run(morph, 13);
  EXPECT_LT(reports.back().farthest, 0.15);
  EXPECT_NEAR(reports.back().volume / (2 * std::numbers::pi * std::numbers::pi * 8 * 9), 1, 0.01);
  EXPECT_EQ(reports.back().components, 1u);
}

TEST(Morph, EasesInAndOut) {
  const auto a = field::sphere({0, 0, 0}, 4), b = field::sphere({0, 0, 0}, 10);
  Morph morph(*a, *b, settings());
  std::vector<double> radius;
  for (const MorphReport& r : run(morph, 13)) radius.push_back(test::radius_of(r.volume));
  EXPECT_NEAR(radius[6], 7, 0.25);  // half way at half time
  EXPECT_LT(radius[1] - radius[0], 0.5 * (radius[7] - radius[6]));
  EXPECT_LT(radius[12] - radius[11], 0.5 * (radius[7] - radius[6]));
}

TEST(Morph, ShapesThatDoNotMeetGrowFromASeed) {
  const auto a = field::sphere({-10, 0, 0}, 4), b = field::sphere({10, 0, 0}, 5);
  Morph morph(*a, *b, settings());
  const auto reports = run(morph, 13);
  EXPECT_TRUE(reports.back().grown);
  EXPECT_EQ(reports.back().components, 1u);
  EXPECT_NEAR(test::radius_of(reports.back().volume), 5, 0.05);
}

TEST(Morph, VelocitiesLeadToTheNextFrame) {
  const auto a = field::sphere({0, 0, 0}, 4), b = field::sphere({0, 0, 0}, 10);
  Morph morph(*a, *b, settings());
  run(morph, 6);
  const Crossings c = find_crossings(morph.band());
  std::vector<Vec3> x(c.size());
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = c.x.view()[i];
  const std::vector<Vec3> v = morph.velocities(x);
  morph.next();
  double mean = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    mean += std::abs(morph.band().sample(x[i] + v[i] / 24.0)) / static_cast<double>(x.size());
  EXPECT_LT(mean, 0.1 * 0.5);  // a tenth of a voxel; the surface moves by about 0.7 units
}

TEST(Morph, RefusesWhatMakesNoSense) {
  const auto a = field::sphere({0, 0, 0}, 4);
  const auto plane = field::plane({0, 0, 0}, {0, 1, 0});
  EXPECT_THROW(Morph(*a, *a, MorphOptions{}), InvalidInput);
  EXPECT_THROW(Morph(*a, *plane, settings()), InvalidInput);
}

}  // namespace
}  // namespace meniscus::band
