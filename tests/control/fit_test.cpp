#include <meniscus/base/error.h>
#include <meniscus/base/random.h>
#include <meniscus/control/fit.h>
#include <meniscus/control/tools.h>
#include <meniscus/field/blobs.h>
#include <meniscus/field/primitives.h>

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace meniscus::control {
namespace {

using field::Number;

std::vector<double> values(const field::Field& f) {
  std::vector<double> q;
  for (const auto& p : f.parameters()) q.push_back(p.value);
  return q;
}

std::unique_ptr<field::Field> ball(const Vec3& c, double r) {
  return field::sphere({Number(c.x()), Number(c.y()), Number(c.z())}, Number(r));
}

TEST(Fit, SphereThroughFourPointsIsExact) {
  for (const double scale : {0.01, 1.0, 1000.0}) {
    const Vec3 c = Vec3(1, -2, 0.5) * scale;
    const double r = 1.7 * scale;
    std::vector<Vec3> points;
    for (const Vec3& d : {Vec3(1, 0, 0), Vec3(-0.6, 0.8, 0), Vec3(0, -0.6, 0.8), Vec3(0, 0, -1)})
      points.push_back(c + r * d);
    const auto f = ball(Vec3(0, 0, 0), scale);
    const FitReport report = fit(*f, points);
    EXPECT_TRUE(report.converged);
    EXPECT_LE(report.largest, 1e-9 * scale);
    for (int a = 0; a < 3; ++a) EXPECT_NEAR(values(*f)[static_cast<std::size_t>(a)], c[a], 1e-8 * scale);
    EXPECT_NEAR(values(*f)[3], r, 1e-8 * scale);
  }
}

TEST(Fit, AFifthInconsistentPointGivesTheLeastSquaresSphere) {
  // By symmetry: four points on a square and one above its middle, too near: c and r follow from one equation.
  std::vector<Vec3> points{{1, 0, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 0, -1}, {0, 1, 0}, {0, -0.5, 0}};
  const auto f = ball(Vec3(0.1, 0.2, 0.05), 0.8);
  const FitReport report = fit(*f, points);
  EXPECT_TRUE(report.converged);
  const double rms = report.rms;
  EXPECT_GT(rms, 0.05);
  // The residuals reported are the true distances, and no sphere near by is better.
  const std::vector<double> q = values(*f);
  const auto rms_of = [&](const std::vector<double>& s) {
    double sum = 0;
    for (const Vec3& p : points) sum += std::pow((p - Vec3(s[0], s[1], s[2])).norm() - s[3], 2);
    return std::sqrt(sum / static_cast<double>(points.size()));
  };
  EXPECT_NEAR(rms_of(q), rms, 1e-12);
  for (std::size_t k = 0; k < 4; ++k)
    for (const double d : {-1e-3, 1e-3}) {
      std::vector<double> near = q;
      near[k] += d;
      EXPECT_GT(rms_of(near), rms);
    }
  EXPECT_NEAR(q[0], 0, 1e-4);
  EXPECT_NEAR(q[2], 0, 1e-4);
}

TEST(Fit, BlobsFindPointsOfOtherBlobs) {
  const auto make = [](double shift) {
    std::vector<field::Blob> items;
    for (int i = 0; i < 4; ++i) {
      const double s = shift * (2 * random_uniform(3, static_cast<std::uint64_t>(i), 0)[0] - 1);
      items.push_back({{Number(0.8 * i + s), Number(s), Number(-s)}, Number(0.9 + 0.2 * s), Number(1.0)});
    }
    return field::blobs(field::BlobKernel::Gaussian, Number::frozen(0.3), items);
  };
  const auto wanted = make(0.2), f = make(0);
  std::vector<Vec3> points;
  for (std::uint64_t i = 0; points.size() < 80; ++i) {
    const auto u = random_uniform(5, i, 0);
    if (const auto p = nearest_surface_point(*wanted, Vec3(4 * u[0] - 0.8, 2 * u[1] - 1, 2 * u[2] - 1), 3))
      points.push_back(*p);
  }
  FitOptions options;
  options.most_steps = 1000;  // radii and weights trade along a flat, winding valley
  const FitReport report = fit(*f, points, options);
  EXPECT_GT(report.rms_before, 0.01);
  EXPECT_LT(report.rms, 1e-6);
}

TEST(Fit, BadInput) {
  const auto f = ball(Vec3::Zero(), 1);
  EXPECT_THROW(fit(*f, {Vec3(std::nan(""), 0, 0)}), InvalidInput);
  EXPECT_EQ(fit(*f, {}).rms, 0);
  EXPECT_EQ(values(*f)[3], 1);
}

TEST(Tools, TakeHoldOfWhatIsNear) {
  const std::vector<Vec3> points{{0, 0, 0}, {0.5, 0, 0}, {2, 0, 0}};
  const auto pull = falloff_pull(points, Vec3::Zero(), 1, Vec3(0, 1, 0));
  ASSERT_EQ(pull.size(), 2u);
  EXPECT_EQ(pull[0].target, Vec3(0, 1, 0));
  EXPECT_NEAR(pull[1].target.y(), 0.5625, 1e-15);
  const auto turned = rigid_patch(points, Vec3::Zero(), 1, Vec3(0, 0, std::numbers::pi / 2), Vec3(0, 0, 1));
  EXPECT_LE((turned[1].target - Vec3(0, 0.5, 1)).norm(), 1e-15);
  EXPECT_EQ(keep_fixed(points, Vec3::Zero(), 1)[1].target, points[1]);
  EXPECT_THROW(keep_fixed(points, Vec3::Zero(), 0), InvalidInput);
  const auto f = ball(Vec3::Zero(), 1);
  const auto grown = inflate(*f, {Vec3(0, 1, 0)}, Vec3(0, 1, 0), 0.5, 0.2);
  EXPECT_LE((grown[0].target - Vec3(0, 1.2, 0)).norm(), 1e-14);
}

TEST(Tools, ARigidPatchTurnsAndTheRestStays) {
  std::vector<field::Blob> items;
  for (int i = 0; i < 6; ++i) items.push_back({{Number(0.8 * i), Number(0.0), Number(0.0)}, Number(0.9), Number(1.0)});
  const auto f = field::blobs(field::BlobKernel::Gaussian, Number::frozen(0.3), items);
  std::vector<Vec3> points;
  for (int i = 0; i < 40; ++i) {
    const double x = -0.5 + 0.125 * i, a = 2.4 * i;
    if (const auto p = nearest_surface_point(*f, Vec3(x, std::cos(a), std::sin(a)), 5)) points.push_back(*p);
  }
  ControlSession session(*f);
  const auto moves = falloff_pull(points, Vec3(4, 0.9, 0), 1.2, Vec3(0, 0.3, 0));
  ASSERT_GE(moves.size(), 3u);
  add_moves(session, moves);
  add_moves(session, keep_fixed(points, Vec3(0, 0, 0), 1.2));
  const StepReport r = session.run();
  EXPECT_EQ(r.outcome, StepReport::Outcome::Arrived);
  for (const Control& c : session.controls()) EXPECT_NEAR(field::value_at(*f, c.position), 0, 1e-7);
}

TEST(Tools, AVolumeOrAnAreaIsReached) {
  const auto measure = [](const field::Field& s) {  // a ball's own: what a sampler would tell of it
    const auto q = values(s);
    SurfaceElements e;
    for (int a = 0; a < 3; ++a)
      for (const double side : {-1.0, 1.0}) {
        Vec3 p(q[0], q[1], q[2]);
        p[a] += side * q[3];
        e.points.push_back(p);
        e.areas.push_back(4 * std::numbers::pi * q[3] * q[3] / 6);
      }
    e.volume = 4.0 / 3 * std::numbers::pi * q[3] * q[3] * q[3];
    return e;
  };
  const auto f = ball(Vec3(1, 2, 3), 1);
  const GoalReport report = reach(*f, Measure::Volume, 8 * 4.0 / 3 * std::numbers::pi, measure, 1e-9);
  EXPECT_TRUE(report.reached);
  EXPECT_NEAR(values(*f)[3], 2, 1e-8);
  EXPECT_NEAR(values(*f)[0], 1, 1e-12) << "moving does not change the volume";
  EXPECT_FALSE(reach(*f, Measure::Volume, 1, measure, 1e-9, {"radius"}).reached);
  EXPECT_NEAR(values(*f)[3], 2, 1e-8);
  const GoalReport area = reach(*f, Measure::Area, 4 * std::numbers::pi * 9, measure, 1e-9);
  EXPECT_TRUE(area.reached);
  EXPECT_NEAR(area.value, 4 * std::numbers::pi * 9, 1e-6);
  EXPECT_NEAR(values(*f)[3], 3, 1e-8);
  EXPECT_NEAR(values(*f)[2], 3, 1e-12) << "the centre stays";
  EXPECT_FALSE(reach(*f, Measure::Area, 1, measure, 1e-9, {"radius"}).reached);
  EXPECT_NEAR(values(*f)[3], 3, 1e-8);
  EXPECT_THROW(reach(*f, Measure::Volume, -1, measure), InvalidInput);
  EXPECT_THROW(reach(*f, Measure::Area, std::nan(""), measure), InvalidInput);
}

}  // namespace
}  // namespace meniscus::control
