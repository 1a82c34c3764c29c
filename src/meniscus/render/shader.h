#pragma once

#include <meniscus/render/sampler.h>
#include <meniscus/render/studio.h>
#include <meniscus/render/tracer.h>

namespace meniscus::render {

/// A point of a surface that a ray has met, facing the ray.
struct Interaction {
  Vec3 position;  ///< lifted off the surface, ready to start rays from
  Vec3 normal;    ///< for shading
  Vec3 outward;   ///< shading normal before it was turned to the ray
  Vec3 color;     ///< diffuse, linear
  const Material* material = nullptr;
};

/// Light along camera rays.
class Shader {
 public:
  /// What one ray saw; `alpha` 0 means nothing, and `color` is already multiplied by it.
  struct Sight {
    Vec3 color = Vec3::Zero();
    double alpha = 0;
  };

  /// `ground` is the height of the ground along up in the view frame, if there is one; `pixel_angle` the opening of a pixel.
  Shader(const Geometry& geometry, const Tracer& tracer, const Studio& studio, std::optional<double> ground, Shading shading,
         double pixel_angle);

  /// With `backdrop` the ground takes its colour and alpha is 1 everywhere; without, shadows are translucent black.
  Sight look(const Ray& ray, const Sampler& sampler, const std::optional<Vec3>& backdrop) const;

 private:
  Interaction interaction(const Ray& ray, const Hit& hit) const;
  void on_mesh(const Surface& s, const Ray& ray, const Hit& hit, Interaction& at, double lift) const;
  void on_disc_or_sphere(const Surface& s, const Ray& ray, const Hit& hit, Interaction& at, double lift) const;
  double distance_to_ground(const Ray& ray) const;

  Vec3 key_light(const Vec3& position, const Vec3& normal, double time, const Vec2& u) const;
  Vec3 simple(const Ray& ray, const Hit& hit, const Vec2& u) const;
  Vec3 ground_simple(const Vec3& position, double time, const Vec2& u) const;
  Vec3 indirect(const Ray& ray, const Sampler& sampler, Use use, bool& open) const;
  Vec3 lit(const Ray& ray, const Interaction& at, const Sampler& sampler) const;
  Vec3 shadow_on_ground(const Vec3& position, double time, const Sampler& sampler) const;

  const Geometry& geometry_;
  const Tracer& tracer_;
  const Studio& studio_;
  std::optional<double> ground_;
  Shading shading_;
  double pixel_angle_;
};

}  // namespace meniscus::render
