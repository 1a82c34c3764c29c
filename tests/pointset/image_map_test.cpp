#include <meniscus/pointset/image_map.h>

#include <meniscus/base/error.h>

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::pointset {
namespace {

/// Brightness u + 2 v over the image.
GreyImage ramp(std::size_t width, std::size_t height) {
  GreyImage image{width, height, {}};
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t x = 0; x < width; ++x)
      image.values.push_back(static_cast<float>((static_cast<double>(x) + 0.5) / static_cast<double>(width) +
                                                2 * (1 - (static_cast<double>(y) + 0.5) / static_cast<double>(height))));
  return image;
}

TEST(GreyImage, LinearBrightnessIsReproducedAlsoWhenCoarsened) {
  const GreyImage fine = ramp(64, 32), coarse = coarsened(fine, 1.0 / 10);
  EXPECT_EQ(coarse.width, 16u);
  EXPECT_EQ(coarse.height, 8u);
  for (const double u : {0.2, 0.5, 0.73})
    for (const double v : {0.25, 0.6}) {
      EXPECT_NEAR(brightness(fine, u, v), u + 2 * v, 1e-6);
      EXPECT_NEAR(brightness(coarse, u, v), u + 2 * v, 1e-6);
    }
  EXPECT_EQ(brightness(fine, 1.01, 0.5), 0);
  EXPECT_EQ(brightness(fine, 0.5, -0.01), 0);
}

TEST(Projection, PlanarSeesTheImageUprightFromTheLight) {
  Projection p;
  p.origin = Vec3(1, 2, 3);
  p.width = 4;
  p.height = 2;
  EXPECT_LT((*image_place(p, Vec3(3, 2, 0)) - Vec2(1, 0.5)).norm(), 1e-14);  // right seen from +z
  EXPECT_LT((*image_place(p, Vec3(1, 3, 9)) - Vec2(0.5, 1)).norm(), 1e-14);
  EXPECT_EQ(light(p, Vec3(5, 5, 5)), Vec3(0, 0, -1));
}

TEST(Projection, SphericalAndCylindricalWrapAround) {
  Projection p;
  p.kind = Projection::Kind::Spherical;
  p.width = 360;
  p.height = 180;
  EXPECT_LT((*image_place(p, Vec3(0, 0, 2)) - Vec2(0.5, 0.5)).norm(), 1e-14);
  EXPECT_LT((*image_place(p, Vec3(3, 0, 0)) - Vec2(0.75, 0.5)).norm(), 1e-14);
  EXPECT_LT((*image_place(p, Vec3(0, 1, 1)) - Vec2(0.5, 0.75)).norm(), 1e-14);
  EXPECT_FALSE(image_place(p, Vec3(0, 1, 0)));
  EXPECT_LT((light(p, Vec3(0, 2, 0)) - Vec3(0, -1, 0)).norm(), 1e-14);
  p.kind = Projection::Kind::Cylindrical;
  p.height = 4;
  EXPECT_LT((*image_place(p, Vec3(3, 1, 0)) - Vec2(0.75, 0.75)).norm(), 1e-14);
  EXPECT_LT((light(p, Vec3(3, 1, 0)) - Vec3(-1, 0, 0)).norm(), 1e-14);
}

TEST(Projection, WithoutMeaningIsRejected) {
  Projection p;
  EXPECT_NO_THROW(check(p));
  p.up = Vec3(0, 0, 2);
  EXPECT_THROW(check(p), InvalidInput);
  p = {};
  p.width = 0;
  EXPECT_THROW(check(p), InvalidInput);
  p = {};
  p.kind = Projection::Kind::Spherical;
  p.width = 400;
  EXPECT_THROW(check(p), InvalidInput);
}

}  // namespace
}  // namespace meniscus::pointset
