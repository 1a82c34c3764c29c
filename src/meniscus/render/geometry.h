#pragma once

#include <meniscus/render/render.h>

#include <Eigen/Core>

#include <memory>

namespace meniscus::render {

using Vec3f = Eigen::Vector3f;
using Vec4f = Eigen::Vector4f;  // a point and its radius

/// The frame that everything is rendered in: the camera's target at the origin, the viewing distance 1. Rays then need no
/// tolerance that depends on the scene, and single precision loses nothing far from the world's origin.
struct ViewFrame {
  Vec3 origin;
  double scale;  ///< viewing distance, world units

  explicit ViewFrame(const Camera& camera);
  Vec3 operator()(const Vec3& p) const { return (p - origin) / scale; }
};

/// One mesh, the discs, or the spheres of one cloud, in the view frame and in single precision, as the ray tracer reads it.
/// Arrays have one element per vertex or point; `end` is the place at the end of the exposure (empty when nothing moves).
struct Surface {
  enum class Kind { Mesh, Discs, Spheres };

  Kind kind = Kind::Mesh;
  Material material;
  bool wireframe = false;
  bool rims = false;
  std::vector<Vec4f> begin;  ///< radius unused for meshes
  std::vector<Vec4f> end;
  std::vector<Triangle> triangles;
  std::vector<Vec3f> normals;  ///< meshes: empty for facets; discs: always there
  std::vector<Vec3f> colors;   ///< linear RGB, or empty
  std::vector<float> values;   ///< position on the colour map, 0 to 1, or empty; wins over colors

  std::size_t primitives() const { return kind == Kind::Mesh ? triangles.size() : begin.size(); }
};

/// The scene made ready for rays.
struct Geometry {
  std::vector<Surface> surfaces;  ///< those that have anything to show
  ColorMap color_map = ColorMap::Sequential;
  RenderReport report;
};

/// Checks, converts and thins out the scene. Throws as render() does.
Geometry prepare(const Scene& scene, const ViewFrame& view, const RenderOptions& options);

}  // namespace meniscus::render
