#pragma once

#include <meniscus/base/vec.h>

#include <cstddef>
#include <optional>
#include <vector>

namespace meniscus::pointset {

/// Brightness from 0 (black) to 1 (white), row by row from the top.
struct GreyImage {
  std::size_t width = 0, height = 0;
  std::vector<float> values;

  float at(std::size_t x, std::size_t y) const { return values[y * width + x]; }
};

/// Halved until a pixel is no smaller than `size` of the whole width: detail finer than the points cannot be shown.
GreyImage coarsened(const GreyImage& image, double size);

/// The brightness at (u, v), both from 0 to 1, v from the bottom up; smooth (quadratic B-spline), 0 outside.
double brightness(const GreyImage& image, double u, double v);

/// How an image lies on a surface. World units; angles in degrees.
struct Projection {
  enum class Kind {
    Planar,       ///< thrown along `direction` from a rectangle about `origin`
    Cylindrical,  ///< wrapped about the axis through `origin` along `up`, `width` degrees around and `height` high
    Spherical,    ///< as on a globe about `origin`, `width` by `height` degrees
  };
  Kind kind = Kind::Planar;
  Vec3 origin = Vec3::Zero();
  Vec3 direction{0, 0, -1};  ///< Planar: of the light. Others: from the origin to the middle of the image, but reversed
  Vec3 up{0, 1, 0};          ///< the image's upward edge, or the axis
  double width = 1, height = 1;
};

/// Throws InvalidInput for a projection without extent, or with an up along its direction.
void check(const Projection& projection);

/// Image coordinates of a place, u to the right, v upwards, 0 to 1 inside the image. Nothing at the axis.
std::optional<Vec2> image_place(const Projection& projection, const Vec3& x);

/// The direction of the light at a place, a unit vector: surfaces that face it get the image.
Vec3 light(const Projection& projection, const Vec3& x);

}  // namespace meniscus::pointset
