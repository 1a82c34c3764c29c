#include <meniscus/base/error.h>
#include <meniscus/pointset/local_fit.h>
#include <meniscus/pointset/point_set_field.h>

#include "shapes.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace meniscus::pointset {
namespace {

TEST(PointSet, FramesAreOrthonormalAndRightHanded) {
  for (std::size_t i = 0; i < 300; ++i) {
    const Frame f = frame_about(shapes::direction(i, 300));
    EXPECT_NEAR((f.u.cross(f.v) - f.w).norm(), 0, 1e-14);
    EXPECT_NEAR(std::abs(f.u.dot(f.w)) + std::abs(f.u.norm() - 1) + std::abs(f.v.norm() - 1), 0, 1e-14);
  }
  EXPECT_TRUE(frame_about(-Vec3::UnitZ()).u.allFinite());
}

TEST(PointSet, SamplesComeBack) {
  for (int grid = 3; grid <= kMostGrid; ++grid) {
    FitOptions options;
    options.grid = grid;
    options.neighbours = 3;
    const points::Cloud four = shapes::sphere(4);
    PointSet set = fit(four, options);
    std::vector<double> wanted;
    for (std::size_t k = 0; k < set.coefficients_per_point(); ++k)
      wanted.push_back(std::sin(1.0 + 2.0 * static_cast<double>(k)));
    set_samples(set, 1, wanted);
    // A field of this point alone is its spline.
    PointSet one = set;
    const std::size_t only[] = {1};
    one.keep(only);
    one.reach[0] *= 1 + 1e-9;  // the corner samples stand on the rim
    const std::vector<Vec3> places = sample_positions(set, 1);
    PointSetField alone(set);
    for (std::size_t k = 0; k < places.size(); ++k) {
      // Towards the rim the field passes into the far distance.
      if ((places[k] - set.position(1)).norm() > 0.75 * set.reach[1]) continue;
      PointSetField single(one);
      EXPECT_NEAR(field::value_at(single, places[k]), wanted[k], 1e-6) << grid << " sample " << k;
    }
  }
}

TEST(PointSet, RecordsRestoreEveryBit) {
  PointSet set = fit(shapes::torus(300));
  const PointSet before = set;
  const PointRecord record = set.record(17);
  set.set_position(17, Vec3::Ones());
  set.set_normal(17, Vec3::UnitX());
  set_samples(set, 17, std::vector<double>(27, 3.0));
  EXPECT_NE(set.coefficients, before.coefficients);
  set.restore(17, record);
  EXPECT_EQ(set.x, before.x);
  EXPECT_EQ(set.nz, before.nz);
  EXPECT_EQ(set.coefficients, before.coefficients);
}

TEST(PointSet, KeepsAndAppendsWithAttributes) {
  points::Cloud cloud = shapes::torus(100);
  std::vector<std::int64_t> ids(100);
  for (std::size_t i = 0; i < 100; ++i) ids[i] = static_cast<std::int64_t>(i);
  cloud.attributes.set_integers("id", 1, ids);
  PointSet set = fit(cloud);
  const PointRecord seventh = set.record(7);
  const std::size_t kept[] = {3, 90};
  set.keep(kept);
  EXPECT_EQ(set.size(), 2u);
  EXPECT_EQ(set.position(1), cloud.positions[90]);
  const std::size_t like[] = {0};
  set.append({&seventh, 1}, like);
  EXPECT_EQ(set.position(2), cloud.positions[7]);
  const auto now = set.attributes.integers("id");
  EXPECT_EQ(std::vector<std::int64_t>(now.begin(), now.end()), (std::vector<std::int64_t>{3, 90, 3}));
}

TEST(PointSet, ResidualBoundsHold) {
  const PointSet set = fit(shapes::torus(400));
  for (std::size_t i = 0; i < set.size(); i += 17) {
    const Bounds b = residual_bounds(set, i);
    PointSet one = set;
    const std::size_t only[] = {i};
    one.keep(only);
    const PointSetField field(one);
    for (const Vec3& p : sample_positions(set, i)) {
      if ((p - set.position(i)).norm() > 0.7 * set.reach[i]) continue;
      const double residual = field::value_at(field, p) - set.normal(i).dot(p - set.position(i));
      EXPECT_GE(residual, b.least - 1e-12);
      EXPECT_LE(residual, b.most + 1e-12);
    }
  }
}

TEST(PointSet, RefusesAWrongNumberOfSamples) {
  PointSet set = fit(shapes::sphere(50));
  EXPECT_THROW(set_samples(set, 0, std::vector<double>(26)), InvalidInput);
}

}  // namespace
}  // namespace meniscus::pointset
