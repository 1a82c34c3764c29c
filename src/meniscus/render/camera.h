#pragma once

#include <meniscus/base/box.h>

namespace meniscus::render {

/// A pinhole camera. `up` is also the world's up: the ground lies across it.
struct Camera {
  Vec3 position = Vec3(0, 0, 5);
  Vec3 target = Vec3::Zero();  ///< seen in the middle of the picture; its distance sets what counts as far and near
  Vec3 up = Vec3::UnitY();     ///< need not be perpendicular to the view
  double fov = 30;             ///< vertical opening angle, degrees, 0 < fov < 180
};

/// From where frame() looks, and how tightly it frames.
struct View {
  Vec3 direction = Vec3(0.6, 0.42, 1);  ///< from the subject towards the camera; any length: three-quarter view from above
  Vec3 up = Vec3::UnitY();
  double aspect = 4.0 / 3.0;  ///< width over height of the picture
  double fov = 30;            ///< vertical, degrees
  double margin = 0.12;       ///< free part of the picture on the tighter sides, 0 <= margin < 1
};

/// The camera that looks along -view.direction and holds the whole box in the picture, centred, as large as the margin
/// allows. An empty box counts as a point at the origin; around a point the picture shows a ball of radius 1. Throws
/// InvalidInput for an infinite box or a view without direction, aspect or fov.
Camera frame(const Box& box, const View& view = {});

/// How wide a pixel is where `place` lies in depth, world units, for a picture of width x height pixels; infinity for what
/// is behind the camera or outside of the picture by more than a tenth of its size.
double pixel_size(const Camera& camera, int width, int height, const Vec3& place);

}  // namespace meniscus::render
