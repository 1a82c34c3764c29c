#include <meniscus/base/error.h>
#include <meniscus/control/rows.h>
#include <meniscus/field/primitives.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numbers>

namespace meniscus::control {
namespace {

const Vec3 kCenter(1, 2, 3);

std::unique_ptr<field::Field> ball(double scale = 1) {
  return field::sphere({kCenter.x() * scale, kCenter.y() * scale, kCenter.z() * scale}, 2 * scale);
}

std::size_t parameter(const field::Field& f, const std::string& ending) {
  const auto& all = f.parameters();
  const auto at = std::find_if(all.begin(), all.end(), [&](const auto& p) { return p.name.ends_with(ending); });
  EXPECT_NE(at, all.end()) << ending;
  return static_cast<std::size_t>(at - all.begin());
}

double entry(const field::SparseRows& rows, std::size_t row, std::size_t column) {
  for (std::size_t e = rows.begin[row]; e < rows.begin[row + 1]; ++e)
    if (rows.index[e] == column) return rows.value[e];
  return 0;
}

TEST(Rows, OfABallAreItsNormalsAndMinusOneForItsRadius) {
  for (const double scale : {1.0, 0.01, 1000.0}) {
    const auto f = ball(scale);
    std::vector<Vec3> points, normals;
    for (const Vec3& n : {Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(1, 2, 2).normalized().eval()}) {
      points.push_back(scale * (kCenter + 2.5 * n));
      normals.push_back(n);
    }
    const SurfaceRows s = surface_rows(*f, points, 4 * scale);
    ASSERT_EQ(s.rows.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(s.distance[i], 0.5 * scale, 1e-12 * scale);
      EXPECT_LT((s.normal[i] - normals[i]).norm(), 1e-12);
      EXPECT_NEAR(entry(s.rows, i, parameter(*f, "radius")), -1, 1e-12);
      double motion = 0;  // moving the centre by a unit along n: the surface comes nearer by one
      for (std::size_t a = 0; a < 3; ++a)
        motion += normals[i][static_cast<int>(a)] * entry(s.rows, i, parameter(*f, std::string("center.") + "xyz"[a]));
      EXPECT_NEAR(motion, -1, 1e-12);
    }
    EXPECT_EQ(surface_distance(*f, points, 4 * scale), s.distance);
  }
}

TEST(Rows, WhereTheGradientVanishesLengthIsTheMeasure) {
  const auto f = ball();
  const double nan = std::nan("");
  const SurfaceRows s = surface_rows(*f, {kCenter, {nan, 0, 0}}, 4);
  EXPECT_TRUE(s.normal[0].norm() == 0 || std::abs(s.normal[0].norm() - 1) < 1e-12);
  EXPECT_TRUE(std::isfinite(s.distance[0]));
  EXPECT_LE(std::abs(s.distance[0]), 4.0);
  EXPECT_EQ(s.rows.begin[2], s.rows.begin[1]) << "a point that is none has no row";
}

TEST(Rows, ScalesFreezeByNameAndSuggestTheRightOne) {
  const auto f = ball();
  const SurfaceRows s = surface_rows(*f, {kCenter + Vec3(2, 0, 0)}, 4);
  const std::size_t radius = parameter(*f, "radius");
  const std::string name = f->parameters()[radius].name;
  for (const double x : sensitivity_scale(*f, s)) EXPECT_EQ(x, 1) << "lengths and coordinates count as they are";
  const auto frozen = sensitivity_scale(*f, s, {name});
  EXPECT_EQ(frozen[radius], 0);
  EXPECT_EQ(std::ranges::count(frozen, 0.0), 1);
  try {
    sensitivity_scale(*f, s, {name + "s"});
    FAIL() << "was taken";
  } catch (const InvalidInput& e) {
    EXPECT_NE(std::string(e.what()).find(name), std::string::npos) << e.what();
  }
  EXPECT_THROW(surface_scale(*f, s, {"nobody"}), InvalidInput);
}

TEST(Rows, ARadiusThatBulgesEverywhereCostsMoreThanACoordinate) {
  const auto f = ball();
  std::vector<Vec3> samples;
  for (int i = 0; i < 400; ++i) {  // evenly over the ball
    const double z = (i + 0.5) / 200 - 1, a = i * std::numbers::pi * (3 - std::sqrt(5.0)), r = std::sqrt(1 - z * z);
    samples.push_back(kCenter + 2 * Vec3(r * std::cos(a), r * std::sin(a), z));
  }
  const auto scale = surface_scale(*f, surface_rows(*f, samples, 4));
  // Root mean squares: 1 for the radius, 1/sqrt(3) for a coordinate.
  EXPECT_NEAR(scale[parameter(*f, "center.x")] / scale[parameter(*f, "radius")], std::sqrt(3.0), 0.05);
}

TEST(Rows, SizesStayAboveZeroInAStep) {
  const auto f = ball();
  const StepBounds bounds = step_bounds(*f);
  const std::size_t radius = parameter(*f, "radius");
  EXPECT_DOUBLE_EQ(bounds.lower[radius], -0.999 * 2);
  EXPECT_EQ(bounds.upper[radius], std::numeric_limits<double>::infinity());
  EXPECT_EQ(bounds.lower[parameter(*f, "center.y")], -std::numeric_limits<double>::infinity());
}

TEST(Rows, NearestPointsAndLengthsOfABall) {
  const auto f = ball();
  const auto x = nearest_surface_point(*f, kCenter + Vec3(0, 3, 4), 4);
  ASSERT_TRUE(x);
  EXPECT_LT((*x - (kCenter + 2 * Vec3(0, 0.6, 0.8))).norm(), 1e-9);
  EXPECT_FALSE(nearest_surface_point(*f, Vec3::Constant(std::nan("")), 4));
  EXPECT_LT((tight_bounds(*f).size() - Vec3::Constant(4)).norm(), 0.2);
  EXPECT_NEAR(length_scale(*f, {}), 4 * std::sqrt(3.0), 0.2);
  const auto plane = field::plane({0, 0, 0}, {0, 0, 1});
  EXPECT_NEAR(length_scale(*plane, {{0, 0, 0}, {3, 4, 0}}), 5, 1e-12);
  EXPECT_EQ(length_scale(*plane, {}), 1);
}

}  // namespace
}  // namespace meniscus::control
