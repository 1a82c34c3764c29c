#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/vec.h>
#include <meniscus/pointset/image_map.h>
#include <meniscus/pointset/sculpt_grid.h>

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace meniscus::pointset {

/// How a tool's effect falls from 1 at its path to 0 at its radius.
struct Falloff {
  enum class Kind {
    Gaussian,   ///< exp(−4.5 r²), lowered to end at 0
    Constant,   ///< 1 up to 0.8, then a smooth end
    Spherical,  ///< √(1 − r²)
    Smooth,     ///< (1 − r²)²
    Custom,     ///< linear between `custom`
  };
  Kind kind = Kind::Gaussian;
  std::vector<double> custom;  ///< at equal steps of r from 0 to 1, two or more

  /// The share at distance r in radii; 0 beyond 1.
  double at(double r) const;
};

/// One action of a sculptor: a tool, led along a path.
struct Stroke {
  enum class Tool {
    Force,    ///< pulls on a voxel region of springs in value; see SculptGrid
    Inflate,  ///< moves the surface outwards by `strength`
    Smooth,   ///< `strength` 0 … 1 of the way to the mean of the neighbours, ten times
    Flatten,  ///< `strength` 0 … 1 of the way to the plane of the surface under the tool
    Crease,   ///< draws the surface together towards the path and raises it there by `strength`
    Drag,     ///< carries the surface along `direction` by `strength`
    Emboss,   ///< raises the surface by `strength` times the brightness of `image`; below 0 engraves
    Refine,   ///< brings the points to `spacing` and keeps them there
  };
  Tool tool = Tool::Force;
  std::string label;       ///< for people; the tool's name when empty
  std::vector<Vec3> path;  ///< where the tool goes: one place or a drawn curve; Emboss, Refine: none needed = everywhere
  double radius = 0;       ///< of the tool, world units, > 0
  /// World units, except for Smooth and Flatten; below 0 goes inwards. Force: how far the values change at most, so about
  /// how far the surface moves; the force that does it follows from that, since springs in value are linear.
  double strength = 0;
  Falloff falloff;
  std::optional<Vec3> direction;  ///< of Force (otherwise along the normals) and Drag; any length
  std::array<bool, 3> mirror{};   ///< also do it mirrored at x = 0, y = 0, z = 0
  std::optional<Box> region;      ///< nothing outside changes

  // Force.
  /// Stiffness counts in radii² / s², so that a tool acts alike at any scale.
  Material material;
  double seconds = 0.5;  ///< how long the force acts, > 0
  int steps = 12;        ///< of the dynamics, >= 1: an update of the points each
  int voxels = 40;       ///< along the region's longest side, 8 … 256

  // Emboss.
  std::shared_ptr<const GreyImage> image;
  Projection projection;

  double spacing = 0;  ///< Refine: wanted distance between points, world units, > 0
};

/// "force", "inflate", … and back; nothing for a word that is no tool's name.
std::string name_of(Stroke::Tool tool);
std::optional<Stroke::Tool> tool_named(const std::string& name);

/// Throws InvalidInput, naming what is wrong, for a stroke that cannot be done.
void check(const Stroke& stroke);

/// Where a stroke acts: its path and the mirror images of it.
class ToolShape {
 public:
  explicit ToolShape(const Stroke& stroke);

  /// What the tool does at a place.
  struct Reach {
    double weight = 0;            ///< 0 … 1
    Vec3 nearest = Vec3::Zero();  ///< the place on the path
    Vec3 signs = Vec3::Ones();    ///< by which the axes are mirrored there
  };
  Reach at(const Vec3& x) const;
  double weight(const Vec3& x) const { return at(x).weight; }
  /// Holds every place with a weight above 0.
  Box bounds() const { return bounds_; }

 private:
  struct Copy {
    std::vector<Vec3> path;
    Vec3 signs;
  };
  std::vector<Copy> copies_;
  Falloff falloff_;
  double radius_;
  std::optional<Box> region_;
  bool everywhere_ = false;
  Box bounds_;
};

}  // namespace meniscus::pointset
