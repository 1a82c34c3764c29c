#include <meniscus/sample/closing.h>

#include "surfaces.h"

#include <gtest/gtest.h>

namespace meniscus::sample {
namespace {

TEST(Land, PointsThatComeDownOnAnotherAreOne) {
  for (const double scale : {0.01, 1.0, 1000.0}) {
    const auto sphere = test::sphere(scale);
    Population p;
    const auto add = [&](const Vec3& x, const Vec3& n) { p.push_back(scale * x, n, 0.2 * scale); };
    add({1.1, 0, 0}, Vec3::UnitX());
    add({0.95, 0, 0}, Vec3::UnitX());   // comes down on the first
    add({1, 0.009, 0}, Vec3::UnitX());  // within 0.05 spacings of it
    add({1, 0.011, 0}, Vec3::UnitX());  // not quite
    add({0, 1, 0}, Vec3::UnitY());
    EXPECT_EQ(land(*sphere, Box::around(Vec3::Zero(), 2 * scale), 1e-12 * scale, p), 2u) << scale;
    ASSERT_EQ(p.points.size(), 3u);
    EXPECT_EQ(p.id.size(), 3u);
    EXPECT_EQ(p.spacing.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(p.points.position(i).norm(), scale, 1e-11 * scale);
    EXPECT_NEAR(p.points.position(1).y(), 0.011 * scale, 1e-4 * scale);
  }
}

TEST(Land, TheTwoSidesOfAThinBodyAreNotTwins) {
  const auto plate = field::box(test::at(0, 0, 0), test::at(4, 4, 0.004));
  Population p;
  p.push_back({0, 0, 0.002}, Vec3::UnitZ(), 0.2);
  p.push_back({0, 0, -0.002}, -Vec3::UnitZ(), 0.2);
  EXPECT_EQ(land(*plate, Box::around(Vec3::Zero(), 2.1), 1e-12, p), 0u);
  EXPECT_EQ(p.points.size(), 2u);
}

TEST(Land, WhatFindsNoSurfaceIsDropped) {
  const auto sphere = test::sphere();
  Population p;
  p.push_back({1, 0, 0}, Vec3::UnitX(), 0.2);
  p.push_back({3, 0, 0}, Vec3::UnitX(), 0.2);  // farther than a spacing
  p.push_back({0, 0, 0}, Vec3::UnitX(), 0.2);  // no gradient
  EXPECT_EQ(land(*sphere, Box::around(Vec3::Zero(), 4), 1e-12, p), 2u);
  EXPECT_EQ(p.points.size(), 1u);
  Population none;
  EXPECT_EQ(land(*sphere, Box::around(Vec3::Zero(), 4), 1e-12, none), 0u);
}

}  // namespace
}  // namespace meniscus::sample
