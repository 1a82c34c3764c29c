#include <meniscus/scene/upsampled_view.h>

#include <meniscus/base/error.h>
#include <meniscus/pointset/local_fit.h>
#include <meniscus/render/render.h>

#include "pointset/shapes.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace meniscus::scene {
namespace {

constexpr int kWidth = 200, kHeight = 160;

pointset::Solid fitted(const points::Cloud& cloud) {
  pointset::Solid solid;
  solid.set = pointset::fit(cloud);
  return solid;
}

render::Camera camera() { return {.position = Vec3(1, 2, 5), .target = Vec3(0.1, 0, 0), .up = Vec3::UnitY(), .fov = 30}; }

render::Image picture(const points::Cloud& cloud, double shutter = 0) {
  render::Scene scene;
  scene.clouds.push_back({.cloud = cloud, .rims = false});
  render::RenderOptions o;
  o.width = kWidth;
  o.height = kHeight;
  o.samples = 16;
  o.shading = render::Shading::Normal;
  o.transparent = true;
  o.shutter = shutter;
  o.fps = 1;
  return render::render(scene, camera(), o);
}

/// Where the ray through the middle of a pixel comes closest to the unit ball: its distance from the centre, and, if it
/// meets the ball, the normal there.
struct Sight {
  double distance;
  Vec3 normal;
};
Sight sight(int x, int y) {
  const render::Camera c = camera();
  const double slope = std::tan(c.fov * std::numbers::pi / 360);
  const Vec3 forward = (c.target - c.position).normalized(), right = forward.cross(c.up).normalized();
  const Vec3 up = right.cross(forward);
  const Vec3 d =
      (forward + slope * ((2 * (x + 0.5) - kWidth) / kHeight * right + (1 - 2 * (y + 0.5) / kHeight) * up)).normalized();
  const double along = -c.position.dot(d), distance = (c.position + along * d).norm();
  const double half = std::sqrt(std::max(0.0, 1 - distance * distance));
  return {distance, c.position + (along - half) * d};
}

TEST(UpsampledView, OfASphereIsThePictureOfTheSphere) {
  const points::Cloud dense = upsampled_for(fitted(pointset::shapes::sphere(1500)), camera(), kWidth, kHeight);
  const render::Image image = picture(dense);
  const double pixel = render::pixel_size(camera(), kWidth, kHeight, Vec3::Zero());
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const render::Pixel& p = image.at(x, y);
      const Sight s = sight(x, y);
      if (s.distance > 1 + 2.5 * pixel) EXPECT_EQ(p.a, 0) << x << ' ' << y << ": sticks out";
      if (s.distance > 1 - 2 * pixel) continue;
      ASSERT_EQ(p.a, 1) << x << ' ' << y << ": a hole";
      const Vec3 n = 2 * Vec3(p.r, p.g, p.b) - Vec3::Ones();
      if (s.distance < 0.95) EXPECT_LT((n - s.normal).norm(), 3 * pixel) << x << ' ' << y;
    }
}

TEST(UpsampledView, KeepsToItsLimit) {
  const pointset::Solid sphere = fitted(pointset::shapes::sphere(1500));
  pointset::UpsampleReport report;
  const points::Cloud dense = upsampled_for(sphere, camera(), 4000, 3000, {.pixels = 1, .most = 50000}, &report);
  EXPECT_LE(dense.size(), 50000u);
  EXPECT_GT(report.coarser, 2);
  EXPECT_THROW(upsampled_for(sphere, camera(), 40, 30, {.pixels = 0, .most = 10}), InvalidInput);
}

TEST(UpsampledView, MovesWithTheCloud) {
  points::Cloud cloud = pointset::shapes::sphere(1500);
  std::vector<double> v;
  for (std::size_t i = 0; i < cloud.size(); ++i) v.insert(v.end(), {0.5, 0, 0});
  cloud.attributes.set(attribute::kVelocity, 3, v);
  const points::Cloud dense = upsampled_for(fitted(cloud), camera(), kWidth, kHeight);
  const render::Image still = picture(dense), blurred = picture(dense, 1);
  int soft = 0, lost = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double distance = sight(x, y).distance;
      if (distance > 1.05 && blurred.at(x, y).a > 0 && still.at(x, y).a == 0) ++soft;
      if (distance < 0.7 && blurred.at(x, y).a < 1) ++lost;  // covered at every moment of the exposure
    }
  EXPECT_GT(soft, 300);
  EXPECT_EQ(lost, 0);
}

}  // namespace
}  // namespace meniscus::scene
