#include <meniscus/base/error.h>
#include <meniscus/sample/integrals.h>
#include <meniscus/sample/spread.h>

#include "surfaces.h"

#include <gtest/gtest.h>

#include <numbers>

namespace meniscus::sample {
namespace {

constexpr double kPi = std::numbers::pi;

void expect_within(const Estimate& e, double truth, double relative) {
  EXPECT_NEAR(e.value, truth, relative * std::abs(truth));
  EXPECT_LE(std::abs(e.value - truth), e.error) << "the error estimate is too small";
  EXPECT_LE(e.error, 20 * relative * std::abs(truth)) << "the error estimate says nothing";
}

TEST(Integrals, OfASphereAtAnyScale) {
  for (const double scale : {0.01, 1.0, 1000.0}) {
    const Sampling s = spread(*test::sphere(scale), Box::around(Vec3::Zero(), 1.2 * scale), {.count = 1000});
    const SurfaceIntegrals i = integrate(s.cloud);
    expect_within(i.area, 4 * kPi * scale * scale, 2e-4);
    expect_within(i.volume, 4 * kPi / 3 * scale * scale * scale, 2e-4);
    EXPECT_NEAR(i.total_gauss.value, 4 * kPi, 4 * kPi * 2e-4);
  }
}

TEST(Integrals, OfATorus) {
  const Sampling s = spread(*test::torus(1, 0.4), Box::around(Vec3::Zero(), 1.6), {.count = 3000});
  const SurfaceIntegrals i = integrate(s.cloud);
  expect_within(i.area, 4 * kPi * kPi * 0.4, 5e-4);
  expect_within(i.volume, 2 * kPi * kPi * 0.16, 1e-3);
  EXPECT_NEAR(i.total_gauss.value, 0, 0.05);
}

TEST(Integrals, ErrorsShrinkWithSpacing) {
  double last = 1;
  for (const std::size_t n : {200u, 800u, 3200u}) {
    const Sampling s = spread(*test::sphere(), Box::around(Vec3::Zero(), 1.2), {.count = n});
    const double error = integrate(s.cloud).area.error;
    EXPECT_LT(error, 0.4 * last);
    last = error;
  }
}

TEST(Integrals, MissingAttributesAreRefused) {
  points::Cloud cloud;
  cloud.positions.push_back(Vec3::Zero());
  EXPECT_THROW(integrate(cloud), InvalidInput);
  EXPECT_EQ(integrate({}).area.value, 0);
}

}  // namespace
}  // namespace meniscus::sample
