#pragma once

#include <meniscus/render/camera.h>
#include <meniscus/render/scene.h>

namespace meniscus::render {

/// Orthonormal axes with `z` along a given direction.
struct Axes {
  Vec3 x, y, z;
  explicit Axes(const Vec3& along);
  Vec3 to_world(const Vec3& local) const { return local.x() * x + local.y() * y + local.z() * z; }
};

/// The light of a photographer's studio: a soft box above the camera's left shoulder, a rim light behind, a dome all around,
/// and a backdrop. Light is measured so that a white surface facing `irradiance` 1 shows as 1.
class Studio {
 public:
  Studio(const Lights& lights, const Camera& camera);

  const Vec3& up() const { return up_; }
  const Vec3& key_color() const { return key_color_; }
  /// A direction towards the key light, spread evenly over it by u in [0, 1)².
  Vec3 towards_key(const Vec2& u) const;
  /// Light that comes from the dome along a direction.
  Vec3 dome(const Vec3& direction) const;
  /// Mean light from the dome on a surface with that normal.
  Vec3 dome_irradiance(const Vec3& normal) const;
  /// What a surface of that roughness mirrors from a direction: dome without the lamps, and the two lamps.
  Vec3 mirrored_dome(const Vec3& direction, double roughness) const;
  Vec3 mirrored_key(const Vec3& direction, double roughness) const;
  Vec3 mirrored_rim(const Vec3& direction, double roughness) const;
  /// Behind everything; (x, y) in [0, 1]², from the top left corner.
  static Vec3 backdrop(double x, double y);

 private:
  Vec3 lamp(const Axes& axes, const Vec2& half_size, const Vec3& color, const Vec3& direction, double roughness) const;

  Vec3 up_;
  Axes key_;
  Axes rim_;
  double key_cosine_;  // of the half-angle
  double key_half_;    // half-width of the mirrored key at distance 1
  Vec3 key_color_;
  Vec3 rim_color_;
  double fill_;
};

}  // namespace meniscus::render
