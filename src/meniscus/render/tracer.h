#pragma once

#include <meniscus/render/geometry.h>

#include <limits>

namespace meniscus::render {

struct Ray {
  Vec3 origin;
  Vec3 direction;   ///< unit
  double time = 0;  ///< 0 begin of the exposure, 1 end
};

struct Hit {
  double distance = std::numeric_limits<double>::infinity();
  std::uint32_t surface = 0;    ///< index into Geometry::surfaces
  std::uint32_t primitive = 0;  ///< triangle or point
  double u = 0;                 ///< barycentric weights of the second and third vertex
  double v = 0;
  Vec3 normal = Vec3::Zero();  ///< geometric, not normalised

  explicit operator bool() const { return distance < std::numeric_limits<double>::infinity(); }
};

/// Finds what rays hit. Keeps references to the surfaces, which must outlive it unchanged.
class Tracer {
 public:
  /// Throws ResourceLimit when memory runs out, Cancelled from `run`.
  Tracer(const std::vector<Surface>& surfaces, const RunControl& run);
  ~Tracer();
  Tracer(Tracer&&) = delete;
  Tracer& operator=(Tracer&&) = delete;

  Hit nearest(const Ray& ray) const;
  bool blocked(const Ray& ray) const;

 private:
  struct Scene;
  std::unique_ptr<Scene> scene_;
};

}  // namespace meniscus::render
