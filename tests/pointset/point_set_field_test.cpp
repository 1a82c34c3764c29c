#include <meniscus/pointset/local_fit.h>
#include <meniscus/pointset/point_set_field.h>

#include "field/conformance.h"
#include "shapes.h"

#include <gtest/gtest.h>

namespace meniscus::pointset {
namespace {

using field::conformance::Case;

std::unique_ptr<field::Field> field_of(const points::Cloud& cloud, const FitOptions& fit_options = {},
                                       const PointSetFieldOptions& options = {}) {
  return std::make_unique<PointSetField>(fit(cloud, fit_options), options);
}

TEST(PointSetField, Conforms) {
  FitOptions large;
  large.grid = 5;
  large.neighbours = 30;
  const std::vector<Case> cases = {
      {"sphere of points", [] { return field_of(shapes::sphere(600)); }, 1.3},
      {"torus of points", [] { return field_of(shapes::torus(900)); }, 1.3},
      {"interpolating", [] { return field_of(shapes::torus(900), {}, {.interpolate = true}); }, 1.3},
      {"grid of five", [large] { return field_of(shapes::sphere(200), large); }, 1.3},
      {"open sheet", [] { return field_of(shapes::sheet(400)); }, 1.2},
      {"two points", [] { return field_of(shapes::sphere(2)); }, 1.5},
  };
  for (const Case& c : cases) field::conformance::check(c);
}

TEST(PointSetField, InterpolatesWhenAsked) {
  const points::Cloud cloud = shapes::rounded_cube(1000);
  const auto plain = field_of(cloud), exact = field_of(cloud, {}, {.interpolate = true});
  const PointSet set = fit(cloud);
  const auto values = field::evaluate(*exact, cloud.positions, field::Order::Value);
  for (std::size_t i = 0; i < set.size(); ++i) {
    // The spline's own value at its point: the middle of its domain.
    double own = 0;
    const double n[3] = {0.125, 0.75, 0.125};
    for (std::size_t k = 0; k < 27; ++k) own += set.coefficients_of(i)[k] * n[k / 9] * n[k / 3 % 3] * n[k % 3];
    EXPECT_NEAR(values.value(i), own, 1e-12);
  }
}

TEST(PointSetField, FarDistanceIsThatToTheNearestPointWithItsSign) {
  const auto field = field_of(shapes::sphere(2000));
  for (std::uint64_t i = 0; i < 500; ++i) {
    const Vec3 p = field::conformance::random_point(i, 3);
    if (std::abs(p.norm() - 1) < 0.3) continue;
    EXPECT_NEAR(field::value_at(*field, p), p.norm() - 1, 0.02) << p.transpose();
  }
}

TEST(PointSetField, EndsAtAnOpenBorder) {
  const PointSetField field(fit(shapes::sheet(2500)));
  const auto covered = [&](double x, double y) {
    std::uint8_t c = 2;
    const double z = 0;
    field.covers({&x, &y, &z, 1}, {&c, 1});
    return c == 1;
  };
  const double spacing = 0.04;
  for (double t = -0.9; t < 0.9; t += 0.013) {
    EXPECT_TRUE(covered(0.98, t) && covered(-0.98, t) && covered(t, 0.98) && covered(t, 0.3)) << t;
    EXPECT_FALSE(covered(1 + 1.5 * spacing, t) || covered(t, -1 - 1.5 * spacing)) << t;
  }
  // Beyond it nothing is near zero, so that no search finds a surface there.
  for (double t = -0.9; t < 0.9; t += 0.013)
    EXPECT_GT(std::abs(field::value_at(field, {1 + 1.5 * spacing, t, 1e-4})), 0.5 * spacing);
}

TEST(PointSetField, CoversAllOfAClosedSurface) {
  const points::Cloud probe = shapes::rounded_cube(5000);
  const PointSetField field(fit(shapes::rounded_cube(3000)));
  std::vector<std::uint8_t> covered(probe.size());
  field.covers(field::PositionBatch(probe.positions).view(), covered);
  EXPECT_EQ(std::count(covered.begin(), covered.end(), 1), static_cast<long>(probe.size()));
}

TEST(PointSetField, FollowsItsPointsAfterRefresh) {
  PointSetField field(fit(shapes::sphere(500)));
  for (std::size_t i = 0; i < field.set().size(); ++i)
    field.edit().set_position(i, field.set().position(i) + Vec3(10, 0, 0));
  field.refresh();
  EXPECT_NEAR(field::value_at(field, {11, 0, 0}), 0, 1e-3);
  EXPECT_NEAR(field::value_at(field, {8, 0, 0}), 1, 0.02);
}

}  // namespace
}  // namespace meniscus::pointset
