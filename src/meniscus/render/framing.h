#pragma once

#include <meniscus/render/camera.h>

#include <limits>
#include <optional>

namespace meniscus::render {

/// Finds the camera for a set of balls seen from one direction, in one pass: each side of the view frustum is pushed out
/// until every ball touches it from inside.
class Framing {
 public:
  /// Throws InvalidInput as frame() does.
  explicit Framing(const View& view);

  void add(const Vec3& center, double radius);
  /// The camera; nothing when no ball was added or all are the same point.
  std::optional<Camera> camera() const;

 private:
  View view_;
  Vec3 right_, up_, back_;  // camera axes; back_ points from the subject to the camera
  double slope_x_, slope_y_;
  // Largest reach beyond each side: left, right, bottom, top.
  double reach_[4] = {-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
                      -std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  Box depth_;
};

}  // namespace meniscus::render
