#include <meniscus/base/error.h>
#include <meniscus/render/framing.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace meniscus::render {

Framing::Framing(const View& view) : view_(view) {
  if (!(view.fov > 0 && view.fov < 180)) throw InvalidInput("the field of view must lie between 0 and 180 degrees");
  if (!(view.aspect > 0) || !std::isfinite(view.aspect)) throw InvalidInput("the aspect of a view must be positive");
  if (!(view.margin >= 0 && view.margin < 1)) throw InvalidInput("the margin of a view must lie in [0, 1)");
  if (!(view.direction.norm() > 0) || !view.direction.allFinite()) throw InvalidInput("a view needs a direction");
  if (!(view.up.norm() > 0) || !view.up.allFinite()) throw InvalidInput("a view needs an up vector");

  back_ = view.direction.normalized();
  right_ = view.up.cross(back_);
  if (right_.norm() < 1e-6 * view.up.norm()) {
    // Straight from above or below: any horizontal direction will do for "up", the camera needs one that is not parallel.
    right_ = back_.unitOrthogonal();
    view_.up = back_.cross(right_);
  }
  right_.normalize();
  up_ = back_.cross(right_);
  const double slope = std::tan(view.fov * std::numbers::pi / 360) * (1 - view.margin);
  slope_x_ = slope * view.aspect;
  slope_y_ = slope;
}

// A ball at (x, y, z) of the camera's axes is inside the right side if x + r sqrt(1 + slope²) <= (distance - z) slope +
// offset.
void Framing::add(const Vec3& center, double radius) {
  const double x = right_.dot(center), y = up_.dot(center), z = back_.dot(center);
  const double rx = radius * std::sqrt(1 + 1 / (slope_x_ * slope_x_));
  const double ry = radius * std::sqrt(1 + 1 / (slope_y_ * slope_y_));
  reach_[0] = std::max(reach_[0], -x / slope_x_ + z + rx);
  reach_[1] = std::max(reach_[1], x / slope_x_ + z + rx);
  reach_[2] = std::max(reach_[2], -y / slope_y_ + z + ry);
  reach_[3] = std::max(reach_[3], y / slope_y_ + z + ry);
  depth_.extend(Vec3(0, 0, z - radius));
  depth_.extend(Vec3(0, 0, z + radius));
}

std::optional<Camera> Framing::camera() const {
  if (depth_.empty()) return {};
  // Both sides of a pair are touched when the camera sits in the middle; the tighter pair decides the distance.
  const double x = slope_x_ * (reach_[1] - reach_[0]) / 2;
  const double y = slope_y_ * (reach_[3] - reach_[2]) / 2;
  const double z = std::max(reach_[0] + reach_[1], reach_[2] + reach_[3]) / 2;
  const double middle = depth_.center().z();
  const double extent = depth_.diameter() + std::abs(reach_[0] + reach_[1] - 2 * middle);
  if (!std::isfinite(z) || !(z - middle > 1e-12 * std::abs(middle)) || !(extent > 0)) return {};

  Camera camera;
  camera.position = x * right_ + y * up_ + z * back_;
  camera.target = x * right_ + y * up_ + middle * back_;
  camera.up = view_.up.normalized();
  camera.fov = view_.fov;
  return camera;
}

Camera frame(const Box& box, const View& view) {
  if (!box.empty() && !box.finite()) throw InvalidInput("cannot frame an infinite box");
  Framing framing(view);
  for (int corner = 0; corner < 8 && !box.empty(); ++corner) {
    const auto pick = [&](int axis) { return (corner >> axis & 1) != 0 ? box.max[axis] : box.min[axis]; };
    framing.add(Vec3(pick(0), pick(1), pick(2)), 0);
  }
  if (const auto camera = framing.camera()) return *camera;
  Framing ball(view);
  ball.add(box.empty() ? Vec3(Vec3::Zero()) : box.center(), 1);
  return ball.camera().value();
}

double pixel_size(const Camera& camera, int width, int height, const Vec3& place) {
  constexpr double kBeyond = 1.2;  // of the picture's half size
  const Vec3 forward = (camera.target - camera.position).normalized(), right = forward.cross(camera.up).normalized();
  const Vec3 at = place - camera.position;
  const double half = at.dot(forward) * std::tan(camera.fov * std::numbers::pi / 360);  // height of the picture there
  const bool seen = half > 0 && std::abs(at.dot(right)) <= kBeyond * half * width / height &&
                    std::abs(at.dot(right.cross(forward))) <= kBeyond * half;
  return seen ? 2 * half / height : std::numeric_limits<double>::infinity();
}

}  // namespace meniscus::render
