#include <meniscus/field/grid_field.h>

#include <meniscus/base/error.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <random>

namespace meniscus::field {
namespace {

using Function = std::function<double(const Vec3&)>;

/// Samples `f` on all bricks of a cube of 2 n bricks a side about the origin; `keep` decides which bricks exist.
std::shared_ptr<const Grid> sampled(const Function& f, double voxel, std::int32_t n, double background,
                                    const std::function<bool(std::span<const float>)>& keep = {},
                                    const Vec3& origin = Vec3::Zero()) {
  std::vector<Coord> bricks;
  std::vector<float> values;
  for (std::int32_t a = -n; a < n; ++a)
    for (std::int32_t b = -n; b < n; ++b)
      for (std::int32_t c = -n; c < n; ++c) {
        std::vector<float> brick;
        for (int v = 0; v < 512; ++v) {
          const Vec3 ijk(8 * a + v / 64, 8 * b + v / 8 % 8, 8 * c + v % 8);
          brick.push_back(static_cast<float>(f(origin + voxel * ijk)));
        }
        if (keep && !keep(brick)) continue;
        bricks.push_back({a, b, c});
        values.insert(values.end(), brick.begin(), brick.end());
      }
  return std::make_shared<const Grid>(voxel, origin, background, std::move(bricks), std::move(values));
}

/// A narrow band about the sphere of radius `scale`: clamped at `half_width` voxels, bricks only where the band is.
std::shared_ptr<const Grid> sphere(double voxel, double scale = 1, double half_width = 3) {
  const double background = half_width * voxel;
  const auto distance = [=](const Vec3& x) { return std::clamp(x.norm() - scale, -background, background); };
  const auto in_band = [=](std::span<const float> brick) {
    return std::any_of(brick.begin(), brick.end(), [=](float v) { return std::abs(v) < static_cast<float>(background); });
  };
  return sampled(distance, voxel, static_cast<std::int32_t>(std::ceil((scale / voxel + 4) / 8)), background, in_band);
}

std::vector<Vec3> random_points(std::size_t count, double half_width, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(-half_width, half_width);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i) points.emplace_back(u(random), u(random), u(random));
  return points;
}

class EachInterpolation : public testing::TestWithParam<Interpolation> {};
INSTANTIATE_TEST_SUITE_P(GridField, EachInterpolation, testing::Values(Interpolation::Trilinear, Interpolation::Cubic));

TEST_P(EachInterpolation, ReproducesALinearFunction) {
  const Vec3 slope(1, -2, 0.5);
  const GridField field(sampled([&](const Vec3& x) { return slope.dot(x) + 0.25; }, 0.25, 2, 100), GetParam());
  const auto points = random_points(500, 2.9);
  const JetBatch jets = evaluate(field, points, Order::HessianTime);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(jets.value(i), slope.dot(points[i]) + 0.25, 2e-6);
    EXPECT_LT((jets.gradient(i) - slope).norm(), 2e-5);
    EXPECT_LT(jets.hessian(i).norm(), 4e-4);
    EXPECT_EQ(jets.time(i), 0);
    EXPECT_EQ(jets.gradient_time(i), Vec3(Vec3::Zero()));
  }
}

TEST(GridField, CubicReproducesACubic) {
  const auto f = [](const Vec3& x) { return x.x() * x.x() * x.y() - 0.5 * x.z() * x.z() * x.z() + x.x() * x.y() * x.z(); };
  const GridField field(sampled(f, 0.125, 2, 100), Interpolation::Cubic);
  const auto points = random_points(500, 1.5);
  const JetBatch jets = evaluate(field, points, Order::Hessian);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3& x = points[i];
    EXPECT_NEAR(jets.value(i), f(x), 3e-6);
    const Vec3 g(2 * x.x() * x.y() + x.y() * x.z(), x.x() * x.x() + x.x() * x.z(), -1.5 * x.z() * x.z() + x.x() * x.y());
    EXPECT_LT((jets.gradient(i) - g).norm(), 3e-5);
    Mat3 h;
    h << 2 * x.y(), 2 * x.x() + x.z(), x.y(), 2 * x.x() + x.z(), 0, x.x(), x.y(), x.x(), -3 * x.z();
    EXPECT_LT((jets.hessian(i) - h).norm(), 6e-4);
  }
}

/// Central differences of F and ∇F within one voxel, where the reconstruction is a polynomial.
TEST_P(EachInterpolation, DerivativesAreThoseOfTheReconstruction) {
  const double voxel = 0.1, step = 1e-4 * voxel;
  const GridField field(sphere(voxel), GetParam());
  std::vector<Vec3> points;
  for (const Vec3& u : random_points(300, 1)) {
    const Vec3 x = u.normalized() * (1 + 0.1 * u.x());
    Vec3 v = x / voxel;
    for (double& c : v) c = std::floor(c) + std::clamp(c - std::floor(c), 0.01, 0.99);
    points.push_back(v * voxel);
  }
  const JetBatch jets = evaluate(field, points, Order::Hessian);
  for (int a = 0; a < 3; ++a) {
    std::vector<Vec3> plus = points, minus = points;
    for (Vec3& p : plus) p[a] += step;
    for (Vec3& p : minus) p[a] -= step;
    const JetBatch up = evaluate(field, plus, Order::Hessian), down = evaluate(field, minus, Order::Hessian);
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_NEAR(jets.gradient(i)[a], (up.value(i) - down.value(i)) / (2 * step), 1e-7);
      const Vec3 column = (up.gradient(i) - down.gradient(i)) / (2 * step);
      EXPECT_LT((jets.hessian(i).col(a) - column).norm(), 1e-6 / voxel);
    }
  }
}

TEST(GridField, CubicIsTwiceContinuouslyDifferentiableAcrossVoxels) {
  const double voxel = 0.1;
  const GridField field(sphere(voxel));
  std::vector<Vec3> before, after;
  for (const Vec3& u : random_points(300, 1.4)) {
    const Vec3 at = voxel * (u / voxel).array().round().matrix();  // a voxel corner: bricks and band ends included
    before.push_back(at - Vec3::Constant(1e-12));
    after.push_back(at + Vec3::Constant(1e-12));
  }
  const JetBatch a = evaluate(field, before, Order::Hessian), b = evaluate(field, after, Order::Hessian);
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_NEAR(a.value(i), b.value(i), 1e-11);
    EXPECT_LT((a.gradient(i) - b.gradient(i)).norm(), 1e-9);
    EXPECT_LT((a.hessian(i) - b.hessian(i)).norm(), 1e-7 / voxel);
  }
}

/// Worst errors of F, ∇F and κ over points near the unit sphere.
struct Errors {
  double value = 0, gradient = 0, curvature = 0;
};
Errors sphere_errors(Interpolation interpolation, double voxel, double scale = 1, double half_width = 5) {
  const GridField field(sphere(voxel * scale, scale, half_width), interpolation);
  std::vector<Vec3> points;
  for (const Vec3& u : random_points(2000, 1)) points.push_back(u.normalized() * scale * (1 + 0.4 * voxel * u.x()));
  const JetBatch jets = evaluate(field, points, Order::Hessian);
  Errors worst;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double r = points[i].norm();
    const Mat3 h = jets.hessian(i);
    worst.value = std::max(worst.value, std::abs(jets.value(i) - (r - scale)) / scale);
    worst.gradient = std::max(worst.gradient, (jets.gradient(i) - points[i] / r).norm());
    worst.curvature = std::max(worst.curvature, std::abs(h.trace() * r - 2) / 2);
  }
  return worst;
}

TEST(GridField, CubicConvergesWithTheFourthPowerOfTheVoxel) {
  const Errors coarse = sphere_errors(Interpolation::Cubic, 0.1), fine = sphere_errors(Interpolation::Cubic, 0.05);
  EXPECT_LT(coarse.value, 2e-5);
  EXPECT_GT(coarse.value / fine.value, 12);
  EXPECT_GT(coarse.gradient / fine.gradient, 6);
  EXPECT_GT(coarse.curvature / fine.curvature, 3);
  EXPECT_LT(fine.curvature, 0.001);
  const Errors narrow = sphere_errors(Interpolation::Cubic, 0.02, 1, 3);  // the stencil's corners see the clamped band
  EXPECT_LT(narrow.value, 4e-6);
  EXPECT_LT(narrow.gradient, 1e-3);
}

TEST(GridField, TrilinearConvergesWithTheSquareOfTheVoxel) {
  const Errors coarse = sphere_errors(Interpolation::Trilinear, 0.1), fine = sphere_errors(Interpolation::Trilinear, 0.05);
  EXPECT_LT(coarse.value, 3e-3);
  EXPECT_GT(coarse.value / fine.value, 3.5);
}

TEST(GridField, AccuracyDoesNotDependOnScale) {
  const Errors one = sphere_errors(Interpolation::Cubic, 0.1);
  for (const double scale : {0.01, 1000.0}) {
    const Errors other = sphere_errors(Interpolation::Cubic, 0.1, scale);
    EXPECT_NEAR(other.value, one.value, 1e-6);
    EXPECT_NEAR(other.curvature, one.curvature, 1e-3);
  }
}

TEST_P(EachInterpolation, InsideAndFarAwayAreConstant) {
  const GridField field(sphere(0.02), GetParam());
  const double background = field.grid()->background();
  const std::vector<Vec3> points{{0, 0, 0}, {0.3, -0.2, 0.1}, {0, 0, 5}, {1e30, 0, 0}, {-1e300, 1e300, 1e300}, {0, 3e9, 0}};
  const JetBatch jets = evaluate(field, points, Order::HessianTime);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(jets.value(i), i < 2 ? -background : background);
    EXPECT_EQ(jets.gradient(i), Vec3(Vec3::Zero()));
    EXPECT_EQ(jets.hessian(i), Mat3(Mat3::Zero()));
  }
}

TEST_P(EachInterpolation, PointsThatAreNotFiniteGiveNaN) {
  const GridField field(sphere(0.1), GetParam());
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  const JetBatch jets = evaluate(field, {{nan, 0, 0}, {0, inf, 0}, {0, 0, -inf}, {1, 0, 0}}, Order::HessianTime);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_TRUE(std::isnan(jets.value(i)));
    EXPECT_TRUE(std::isnan(jets.hessian(i)(2, 2)));
    EXPECT_TRUE(std::isnan(jets.gradient_time(i).x()));
  }
  EXPECT_TRUE(std::isfinite(jets.value(3)));
}

TEST_P(EachInterpolation, ABatchGivesTheBitsOfSinglePoints) {
  const GridField field(sphere(0.07), GetParam());
  const auto points = random_points(1000, 1.3);
  JetBatch jets = evaluate(field, points, Order::HessianTime, RunControl({.threads = 2, .seed = 0, .on_progress = {}}));
  for (std::size_t i = 0; i < points.size(); ++i) {
    JetBatch one = evaluate(field, {points[i]}, Order::HessianTime);
    for (std::size_t r = 0; r < row_count(Order::HessianTime); ++r)
      EXPECT_EQ(std::memcmp(&jets.view().row(r)[i], one.view().row(r), sizeof(double)), 0);
  }
}

TEST_P(EachInterpolation, OrdersAgree) {
  const GridField field(sphere(0.07), GetParam());
  const auto points = random_points(100, 1.3);
  const JetBatch all = evaluate(field, points, Order::HessianTime);
  for (const Order order : {Order::Value, Order::Gradient, Order::GradientTime, Order::Hessian}) {
    const JetBatch some = evaluate(field, points, order);
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_EQ(some.value(i), all.value(i));
      if (has_gradient(order)) {
        EXPECT_EQ(some.gradient(i), all.gradient(i));
      }
    }
  }
}

TEST_P(EachInterpolation, RangeHoldsAllValues) {
  const GridField field(sphere(0.05), GetParam());
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-1.5, 1.5), log_size(-3, 0.5);
  for (int n = 0; n < 500; ++n) {
    const Vec3 center(u(random), u(random), u(random));
    const Box box{center, center + std::pow(10, log_size(random)) * Vec3(1, 0.5 + 0.3 * u(random), 0.7)};
    const Interval range = field.range(box);
    std::vector<Vec3> points{box.min, box.max};
    for (const Vec3& p : random_points(50, 0.5, static_cast<unsigned>(n)))
      points.emplace_back(box.min + (p + Vec3::Constant(0.5)).cwiseProduct(box.size()));
    const JetBatch jets = evaluate(field, points, Order::Value);
    for (std::size_t i = 0; i < points.size(); ++i)
      ASSERT_TRUE(range.contains(jets.value(i))) << jets.value(i) << " not in " << range.lo << " … " << range.hi;
  }
}

TEST_P(EachInterpolation, RangeIsTightEnoughToPrune) {
  const double voxel = 0.05;
  const GridField field(sphere(voxel), GetParam());
  EXPECT_GT(field.range(Box::around({1 + voxel, 0, 0}, voxel / 2)).lo, 0);
  EXPECT_LT(field.range(Box::around({1 - voxel, 0, 0}, voxel / 2)).hi, 0);
  EXPECT_LT(field.range(Box::around({0, 0, 0}, 0.2)).hi, 0) << "an interior without bricks";
  EXPECT_GT(field.range(Box::around({9, 0, 0}, 7)).lo, 0);
  EXPECT_TRUE(field.range(Box::around({0, 0, 0}, 2)).contains_zero());
  EXPECT_TRUE(field.range(Box::everywhere()).contains_zero());
  EXPECT_TRUE(field.range(Box::around({std::nan(""), 0, 0}, 1)).contains_zero());
}

TEST_P(EachInterpolation, BoundsHoldTheInside) {
  const GridField field(sphere(0.1), GetParam());
  const Box box = field.bounds();
  EXPECT_TRUE(box.contains(Vec3(1, 0, 0)) && box.contains(Vec3(0, 0, -1)));
  const auto points = random_points(5000, 3);
  const JetBatch jets = evaluate(field, points, Order::Value);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (!box.contains(points[i])) {
      EXPECT_GT(jets.value(i), 0);
    }
}

TEST_P(EachInterpolation, EmptyGridsAreOutside) {
  const GridField field(std::make_shared<const Grid>(1, Vec3::Zero(), 2, std::vector<Coord>{}, std::vector<float>{}),
                        GetParam());
  EXPECT_EQ(value_at(field, {1, 2, 3}), 2);
  EXPECT_TRUE(field.bounds().empty());
  EXPECT_GT(field.range(Box::everywhere()).lo, 0);
}

TEST_P(EachInterpolation, ExtremeSamplesStayFinite) {
  std::mt19937 random(5);
  std::uniform_int_distribution<int> pick(0, 5);
  const float big = std::numeric_limits<float>::max();
  const float choices[] = {big, -big, 1e-45f, -1e-45f, 0, std::nanf("")};
  std::vector<float> values(2 * Grid::kBrickVoxels);
  for (float& v : values) v = choices[pick(random)];
  const GridField field(
      std::make_shared<const Grid>(1e-3, Vec3::Zero(), 1, std::vector<Coord>{{0, 0, 0}, {0, 0, 2}}, values), GetParam());
  const auto points = random_points(2000, 0.03);
  const JetBatch jets = evaluate(field, points, Order::Hessian);
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_TRUE(std::isfinite(jets.value(i)) && jets.gradient(i).allFinite() && jets.hessian(i).allFinite());
}

TEST(GridField, ClonesShareSamplesAndAgree) {
  const GridField field(sphere(0.1));
  const auto copy = field.clone();
  EXPECT_EQ(value_at(*copy, {0.9, 0.2, 0.1}), value_at(field, {0.9, 0.2, 0.1}));
  EXPECT_FALSE(field.moving());
  EXPECT_TRUE(field.parameters().empty());
  EXPECT_THROW(GridField(nullptr), InvalidInput);
}

}  // namespace
}  // namespace meniscus::field
