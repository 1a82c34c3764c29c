#pragma once

#include <meniscus/mesh/mesh.h>
#include <meniscus/points/cloud.h>
#include <meniscus/render/camera.h>
#include <meniscus/render/color_map.h>

#include <optional>
#include <string>
#include <vector>

namespace meniscus::render {

/// How a surface takes the light.
struct Material {
  Vec3 color = Vec3(0.45, 0.20, 0.115);  ///< diffuse, linear RGB
  double roughness = 0.5;                ///< 0 mirror-like highlights, 1 none to speak of
  double reflectance = 0.045;            ///< of light that falls straight in; 0.04 plastic, glazed clay and water, 0 chalk
  bool mirrors = false;                  ///< trace what it reflects, instead of a soft look-up

  /// Slightly glazed terracotta; the default of meshes.
  static Material clay() { return {}; }
  /// Light grey, dull: for shape alone.
  static Material plaster() { return {Vec3(0.58, 0.57, 0.55), 0.7, 0.03, false}; }
  /// Blue with a soft sheen; the default of clouds.
  static Material satin() { return {Vec3(0.04, 0.19, 0.42), 0.4, 0.045, false}; }
  /// Deep blue and glossy, reflecting its surroundings: an opaque liquid.
  static Material liquid() { return {Vec3(0.02, 0.115, 0.34), 0.08, 0.05, true}; }
};

/// A triangle mesh. Vertex attributes used: N (smooth normals; computed if absent), Cd, v, and the scene's color_by.
struct MeshItem {
  mesh::Mesh mesh;
  Material material = Material::clay();
  bool smooth = true;      ///< false: facets, whatever N says
  bool wireframe = false;  ///< draw the edges over the surface
};

/// A point cloud: an oriented disc where there is a normal N, else a sphere. Attributes used: N, pscale, Cd, v, color_by.
struct CloudItem {
  points::Cloud cloud;
  Material material = Material::satin();
  /// For every point, world units. Not given: pscale; without that, half the spacing of so many points in their box.
  std::optional<double> radius = {};
  double radius_scale = 1;  ///< times the radius, wherever it came from
  bool spheres = false;     ///< spheres even where there are normals
  bool rims = true;         ///< darken the rim of discs, so that overlapping ones stay apart
};

/// Colours by an attribute: a scalar through the colour map, a vector by its length. Items without it keep their material.
struct ColorBy {
  std::string attribute;
  ColorMap map = ColorMap::Sequential;
  std::optional<double> min = {};  ///< value at the low end; not given: the smallest finite value there is
  std::optional<double> max = {};
};

/// Lights are soft and neutral; key and rim stand relative to the camera, so that any view is well lit.
struct Lights {
  double key = 1;        ///< strength of the key light, over the left shoulder of the camera
  double key_size = 12;  ///< its half-angle, degrees: larger means softer shadows
  double fill = 1;       ///< strength of the light from all around
  /// Towards the key light, world axes; not given: from the camera's upper left.
  std::optional<Vec3> key_direction = {};
};

/// The plane across the camera's up vector that catches shadows; seen from above only, in the colour of the backdrop.
struct Ground {
  bool visible = true;
  std::optional<double> height = {};  ///< along camera.up, world units; not given: the lowest point of the subject
};

/// Everything in front of the camera. Copies nothing twice: move meshes and clouds in.
///
/// Vertices and points that are NaN, infinite, or more than 10^6 viewing distances away are left out, with the triangles
/// that use them; so are points without a positive radius. RenderReport counts them. A zero or non-finite normal counts as
/// absent.
struct Scene {
  std::vector<MeshItem> meshes;
  std::vector<CloudItem> clouds;
  std::optional<ColorBy> color_by;  ///< not given: Cd where an item has it, else its material
  Lights lights;
  Ground ground;
};

/// The subject's box: all finite vertices, and of clouds of 100 points or more all but strays: those farther outside the
/// 5 % to 95 % range than 0.75 of its width, on any axis. A few evaporated particles do not shrink the picture. Radii
/// included. Empty for an empty scene.
Box subject_bounds(const Scene& scene);

/// The camera that frames the subject itself, tighter than its box: see frame(const Box&, ...).
Camera frame(const Scene& scene, const View& view = {});

}  // namespace meniscus::render
