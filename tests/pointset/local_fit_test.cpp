#include <meniscus/base/error.h>
#include <meniscus/pointset/local_fit.h>
#include <meniscus/pointset/point_set_field.h>

#include "shapes.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

namespace meniscus::pointset {
namespace {

/// Mean distance to the true surface of points brought onto the fitted one, in diameters.
double mean_error(const shapes::Shape& shape, std::size_t n, const FitOptions& options = {}) {
  const PointSetField field(fit(shape.sample(n), options));
  std::vector<Vec3> p = shape.sample(3001).positions;
  for (int step = 0; step < 5; ++step) {
    const auto jets = field::evaluate(field, p, field::Order::Gradient);
    for (std::size_t i = 0; i < p.size(); ++i) p[i] -= jets.value(i) / jets.gradient(i).squaredNorm() * jets.gradient(i);
  }
  double sum = 0;
  for (const Vec3& q : p) sum += std::abs(shape.distance(q));
  return sum / static_cast<double>(p.size()) / shape.diameter;
}

RunControl threads_of(int count) {
  RunOptions options;
  options.threads = count;
  return RunControl(options);
}

/// Second order or better: halving the spacing quarters the error.
TEST(LocalFit, TenThousandPointsAreAccurate) {
  for (const auto& shape : shapes::all()) {
    const double coarse = mean_error(shape, 2500), fine = mean_error(shape, 10'000);
    EXPECT_LE(fine, 1e-4) << shape.name;
    EXPECT_LE(fine, coarse / 4) << shape.name;
  }
}

TEST(LocalFit, GradientRowsAndLargerGridsFitToo) {
  FitOptions gradients, five;
  gradients.rows = FitOptions::Rows::Gradient;
  five.grid = 5;
  five.neighbours = 30;
  for (const auto& shape : shapes::all()) {
    EXPECT_LE(mean_error(shape, 10'000, gradients), 1e-4) << shape.name;
    EXPECT_LE(mean_error(shape, 1500, five), 1e-3) << shape.name;
  }
}

/// A sphere with bumps a few spacings wide: n points with its true normals.
points::Cloud bumpy_sphere(std::size_t n) {
  constexpr double kBump = 0.03, kWave = 14;
  shapes::Builder b;
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 d = shapes::direction(i, n), wave = (kWave * d).array().sin();
    const double radius = 1 + kBump * wave.prod();
    // Of F = |x| / radius(x / |x|) − 1, up to a factor.
    const Vec3 cosine = (kWave * d).array().cos();
    Vec3 slope(cosine.x() * wave.y() * wave.z(), wave.x() * cosine.y() * wave.z(), wave.x() * wave.y() * cosine.z());
    slope *= kBump * kWave;
    b.add(radius * d, (d - (slope - slope.dot(d) * d) / radius).normalized());
  }
  return b.take();
}

/// Detail of eleven spacings a wave, between the points; no sheets appear off the surface where it is five.
TEST(LocalFit, FollowsDetail) {
  const points::Cloud probe = bumpy_sphere(20'011);
  const auto normals = probe.attributes.values(attribute::kNormal, 3);
  const PointSetField field(fit(bumpy_sphere(5000)));
  const auto jets = field::evaluate(field, probe.positions, field::Order::Gradient);
  double angle = 0;
  for (std::size_t i = 0; i < probe.size(); ++i) {
    const Vec3 n(normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]), g = jets.gradient(i);
    angle += std::atan2(g.cross(n).norm(), g.dot(n));
  }
  EXPECT_LT(angle / static_cast<double>(probe.size()), 0.5 * shapes::kPi / 180);

  const PointSetField coarse(fit(bumpy_sphere(1500)));
  for (std::size_t i = 0; i < coarse.set().size(); ++i)
    for (const double h : {-0.6, 0.6}) {
      const PointSet& set = coarse.set();
      EXPECT_GT(h * field::value_at(coarse, set.position(i) + h * set.reach[i] * set.normal(i)), 0) << i;
    }
}

/// Given normals tell the surface where places are noisy.
TEST(LocalFit, NormalsOutweighNoise) {
  const shapes::Shape& torus = shapes::all()[1];
  points::Cloud cloud = torus.sample(10'000);
  for (std::size_t i = 0; i < cloud.size(); ++i) cloud.positions[i] += 0.01 * shapes::gaussian(i);
  const auto error = [&](FitOptions::Rows rows) {
    const PointSet set = fit(cloud, {.rows = rows});
    const PointSetField field(set);
    const std::vector<Vec3> probe = torus.sample(500).positions;
    double sum = 0;
    for (std::size_t i = 0; i < 500; ++i) {
      Vec3 p = probe[i];
      for (int k = 0; k < 5; ++k) {
        const auto jets = field::evaluate(field, std::vector<Vec3>{p}, field::Order::Gradient);
        p -= jets.value(0) / jets.gradient(0).squaredNorm() * jets.gradient(0);
      }
      sum += std::abs(torus.distance(p)) / 500;
    }
    return sum;
  };
  EXPECT_LT(error(FitOptions::Rows::Both), 0.7 * error(FitOptions::Rows::Offset));
}

TEST(LocalFit, NearlyADistance) {
  const PointSetField field(fit(shapes::torus(10'000)));
  const points::Cloud probe = shapes::torus(500);
  const auto normals = probe.attributes.values(attribute::kNormal, 3);
  for (std::size_t i = 0; i < probe.size(); ++i)
    for (const double h : {-0.03, 0.03}) {
      const Vec3 p = probe.positions[i] + h * Vec3(normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]);
      EXPECT_NEAR(field::value_at(field, p), h, 0.003);
    }
}

TEST(LocalFit, SameAtAnyScaleAndPlace) {
  const points::Cloud cloud = shapes::torus(1500);
  const PointSetField field(fit(cloud));
  for (const double scale : {0.01, 1000.0}) {
    const PointSetField scaled(fit(shapes::transformed(cloud, scale)));
    for (std::uint64_t i = 0; i < 200; ++i) {
      const Vec3 p = 1.05 * cloud.positions[7 * i];
      EXPECT_NEAR(field::value_at(scaled, scale * p), scale * field::value_at(field, p), 1e-9 * scale);
    }
  }
  // A million away coordinates hold ten digits of a unit.
  const Vec3 shift(1e6, -1e6, 1e6);
  const PointSetField shifted(fit(shapes::transformed(cloud, 1, shift)));
  for (std::uint64_t i = 0; i < 200; ++i)
    EXPECT_NEAR(field::value_at(shifted, 1.05 * cloud.positions[7 * i] + shift),
                field::value_at(field, 1.05 * cloud.positions[7 * i]), 1e-7);
}

TEST(LocalFit, SameBitsForAnyNumberOfThreads) {
  const points::Cloud cloud = shapes::rounded_cube(3000);
  const PointSet one = fit(cloud, {}, nullptr, threads_of(1));
  for (const int threads : {2, 3, 5, 8}) {
    const PointSet many = fit(cloud, {}, nullptr, threads_of(threads));
    EXPECT_EQ(one.coefficients, many.coefficients) << threads;
    EXPECT_EQ(one.reach, many.reach) << threads;
    EXPECT_EQ(one.bx, many.bx) << threads;
  }
}

TEST(LocalFit, RefitOfAllIsTheFit) {
  const points::Cloud cloud = shapes::torus(1000);
  const PointSet whole = fit(cloud);
  PointSet set = whole;
  std::fill(set.coefficients.begin(), set.coefficients.end(), 0.0);
  std::vector<std::size_t> some;
  for (std::size_t i = 0; i < set.size(); i += 3) some.push_back(i);
  refit(set, some, points::NeighbourSearch(positions(set)));
  for (std::size_t i = 0; i < set.size(); ++i)
    for (std::size_t k = 0; k < 27; ++k)
      EXPECT_EQ(set.coefficients_of(i)[k], i % 3 == 0 ? whole.coefficients_of(i)[k] : 0.0);
}

TEST(LocalFit, ThinPlatesKeepBothSides) {
  // Two sheets closer than a domain is wide: inside stays inside, outside outside.
  shapes::Builder b;
  const double thickness = 0.03;
  for (std::size_t i = 0; i < 2500; ++i)
    for (const double side : {1.0, -1.0})
      b.add({2 * shapes::even(i).x() - 1, 2 * shapes::even(i).y() - 1, 0.5 * side * thickness}, side * Vec3::UnitZ());
  const PointSetField field(fit(b.take()));
  for (std::size_t i = 0; i < 300; ++i) {
    const Vec3 p(1.6 * shapes::even(i).x() - 0.8, 1.6 * shapes::even(i).y() - 0.8, 0);
    EXPECT_LT(field::value_at(field, p), -0.15 * thickness);
    for (const double side : {1.0, -1.0}) {
      EXPECT_GT(field::value_at(field, p + Vec3(0, 0, side * thickness)), 0.15 * thickness);
      EXPECT_NEAR(field::value_at(field, p + Vec3(0, 0, 0.5 * side * thickness)), 0, 0.05 * thickness);
    }
  }
}

TEST(LocalFit, CountsWhatItLeavesOut) {
  points::Cloud cloud = shapes::sphere(2000);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  auto normals = cloud.attributes.values(attribute::kNormal, 3);
  cloud.positions[3].x() = nan;
  cloud.positions[5] = cloud.positions[6] = cloud.positions[4];
  normals[3 * 10] = normals[3 * 10 + 1] = normals[3 * 10 + 2] = 0;
  normals[3 * 11] = nan;
  cloud.positions[20] = Vec3(50, 0, 0);
  FitReport report;
  const PointSet set = fit(cloud, {}, &report);
  EXPECT_EQ(report.points, 2000u);
  EXPECT_EQ(report.not_finite, 1u);
  EXPECT_EQ(report.coincident, 2u);
  EXPECT_EQ(report.without_normal, 2u);
  EXPECT_EQ(report.outliers, 1u);
  EXPECT_EQ(report.domains, 1994u);
  EXPECT_EQ(set.size(), 1994u);
}

TEST(LocalFit, RefusesWhatItCannotUse) {
  points::Cloud bare = shapes::sphere(100);
  bare.attributes.erase(attribute::kNormal);
  EXPECT_THROW(fit(bare), InvalidInput);
  points::Cloud zero = shapes::sphere(100);
  for (double& n : zero.attributes.values(attribute::kNormal, 3)) n = 0;
  EXPECT_THROW(fit(zero), InvalidInput);
  points::Cloud heap = shapes::sphere(100);
  for (Vec3& p : heap.positions) p = Vec3(1, 2, 3);
  EXPECT_THROW(fit(heap), InvalidInput);
  EXPECT_THROW(fit(shapes::sphere(1)), InvalidInput);
  EXPECT_THROW(fit(shapes::sphere(0)), InvalidInput);
  EXPECT_THROW(fit(shapes::sphere(100), {.neighbours = 0}), InvalidInput);
  EXPECT_THROW(fit(shapes::sphere(100), {.grid = 2}), InvalidInput);
  EXPECT_THROW(fit(shapes::sphere(100), {.grid = 7}), InvalidInput);
  EXPECT_THROW(fit(shapes::sphere(100), {.smoothing = -1}), InvalidInput);
}

TEST(LocalFit, FewPointsAndLinesGiveFiniteSurfaces) {
  for (std::size_t n = 2; n <= 8; ++n) {
    const PointSet set = fit(shapes::sphere(n));
    const PointSetField field(set);
    const auto jets = field::evaluate(field, positions(set), field::Order::Hessian);
    for (std::size_t i = 0; i < n; ++i) {
      EXPECT_TRUE(std::isfinite(jets.value(i)) && jets.gradient(i).allFinite() && jets.hessian(i).allFinite()) << n;
      EXPECT_GT(jets.gradient(i).dot(set.normal(i)), 0) << n;
    }
  }
  shapes::Builder line;
  for (int i = 0; i < 60; ++i) line.add({0.1 * i, 0.2 * i, 0}, Vec3::UnitZ());
  const PointSetField field(fit(line.take()));
  EXPECT_NEAR(field::value_at(field, {3, 6, 0}), 0, 1e-9);
  EXPECT_NEAR(field::value_at(field, {3, 6, 0.1}), 0.1, 1e-3);
}

}  // namespace
}  // namespace meniscus::pointset
