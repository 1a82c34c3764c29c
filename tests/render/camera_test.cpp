#include <meniscus/base/error.h>
#include <meniscus/render/render.h>

#include "tests/render/scenes.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>

namespace meniscus::render {
namespace {

/// Rows and columns of the picture that hold something: {left, right, top, bottom}, inclusive.
std::array<int, 4> extent(const Image& image) {
  std::array<int, 4> e = {image.width(), -1, image.height(), -1};
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      if (image.at(x, y).a < 0.5F) continue;
      e = {std::min(e[0], x), std::max(e[1], x), std::min(e[2], y), std::max(e[3], y)};
    }
  }
  return e;
}

TEST(Camera, FramesTheSubjectTightlyAndCentred) {
  for (const double scale : {0.01, 1.0, 1000.0}) {
    Scene scene;
    scene.meshes.push_back({.mesh = sphere_mesh(scale, 64, scale * Vec3(5, 1, -3))});
    const Image image = render(scene, frame(scene, {.aspect = 1.5, .margin = 0.2}), flat(150, 100, 4));
    const auto [left, right, top, bottom] = extent(image);
    EXPECT_NEAR(bottom - top + 1, 80, 2);
    EXPECT_NEAR(top, 10, 2);
    EXPECT_NEAR(left, 149 - right, 2);
  }
}

TEST(Camera, FramesAllCornersOfABox) {
  const Box box{Vec3(-1, -2, 0), Vec3(4, 1, 3)};
  for (const Vec3& direction : {Vec3(0.6, 0.4, 1.0), Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, -1, 0)}) {
    const View view{.direction = direction, .aspect = 1, .fov = 60, .margin = 0};
    const Camera camera = frame(box, view);
    const Vec3 forward = (camera.target - camera.position).normalized();
    const Vec3 right = forward.cross(camera.up).normalized();
    const Vec3 up = right.cross(forward);
    double widest = 0;
    for (int c = 0; c < 8; ++c) {
      const Vec3 p((c & 1) != 0 ? 4 : -1, (c & 2) != 0 ? 1 : -2, (c & 4) != 0 ? 3 : 0);
      const Vec3 d = p - camera.position;
      ASSERT_GT(d.dot(forward), 0);
      widest = std::max({widest, std::abs(d.dot(right) / d.dot(forward)), std::abs(d.dot(up) / d.dot(forward))});
    }
    EXPECT_NEAR(widest, std::tan(std::numbers::pi / 6), 1e-12);
  }
}

TEST(Camera, PointsAndNothingStillHaveACamera) {
  for (const Box& box : {Box{}, Box{Vec3(7, 7, 7), Vec3(7, 7, 7)}}) {
    const Camera camera = frame(box);
    EXPECT_GT((camera.position - camera.target).norm(), 1);
    EXPECT_LT((camera.position - camera.target).norm(), 10);
  }
  EXPECT_THROW((void)frame(Box::everywhere()), InvalidInput);
  EXPECT_THROW((void)frame(Box{}, {.fov = 180}), InvalidInput);
  EXPECT_THROW((void)frame(Box{}, {.direction = Vec3::Zero()}), InvalidInput);
}

TEST(Scene, OneStrayPointDoesNotShrinkThePicture) {
  Scene scene;
  points::Cloud cloud;
  for (int i = 0; i < 1000; ++i) cloud.positions.emplace_back(i % 10, i / 10 % 10, i / 100);
  scene.clouds.push_back({.cloud = cloud, .radius = 0.5});
  const Box without = subject_bounds(scene);
  const Camera camera = frame(scene);
  EXPECT_NEAR(without.max.x(), 9.5, 1e-12);
  scene.clouds[0].cloud.positions.push_back(Vec3(1e6, 0, 0));
  EXPECT_EQ(subject_bounds(scene).max, without.max);
  EXPECT_NEAR((frame(scene).position - camera.position).norm(), 0, 1e-9);
}

TEST(Camera, PixelsAreAsWideAsTheirDepthSays) {
  const Camera camera{.position = Vec3(0, 0, 10), .target = Vec3::Zero(), .up = Vec3::UnitY(), .fov = 90};
  EXPECT_NEAR(pixel_size(camera, 200, 100, Vec3::Zero()), 0.2, 1e-12);
  EXPECT_NEAR(pixel_size(camera, 200, 100, Vec3(0, 0, 5)), 0.1, 1e-12);
  EXPECT_NEAR(pixel_size(camera, 200, 100, Vec3(19, -9, 0)), 0.2, 1e-12);
  for (const Vec3& out : {Vec3(0, 0, 11), Vec3(25, 0, 0), Vec3(0, -13, 0)})
    EXPECT_TRUE(std::isinf(pixel_size(camera, 200, 100, out))) << out.transpose();
}

TEST(Scene, RadiusComesFromTheItemThenPscaleThenSpacing) {
  CloudItem item;
  for (int i = 0; i < 1000; ++i) item.cloud.positions.emplace_back(i % 10, i / 10 % 10, i / 100);
  const auto width = [&] {
    Scene scene;
    scene.clouds.push_back(item);
    return subject_bounds(scene).size().x() - 9;
  };
  EXPECT_NEAR(width(), 0.9, 1e-9);  // spacing 9 / 10 for 10 points across
  item.cloud.attributes.set("pscale", 1, std::vector<double>(1000, 2.0));
  EXPECT_NEAR(width(), 4, 1e-9);
  item.radius = 1;
  item.radius_scale = 0.5;
  EXPECT_NEAR(width(), 1, 1e-9);
}

}  // namespace
}  // namespace meniscus::render
