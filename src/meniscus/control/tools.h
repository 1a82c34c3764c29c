#pragma once

#include <meniscus/base/vec.h>
#include <meniscus/control/drag.h>
#include <meniscus/field/field.h>

#include <functional>
#include <vector>

namespace meniscus::control {

/// Where a point of the surface shall go: a row of a tool that works on several points.
struct Move {
  Vec3 point;
  Vec3 target;
};

// Tools over several points of a surface, such as floaters: each answers with the moves of the points it takes hold of, in
// the order given. All throw InvalidInput for numbers that are not finite or a radius that is not above zero.

/// Points within `radius` of `center` go along by (1 − (d/radius)²)² of `by`.
std::vector<Move> falloff_pull(const std::vector<Vec3>& points, const Vec3& center, double radius, const Vec3& by);
/// Points within `radius` of `center` move as one body: turned by `rotation` (axis times angle) about the centre, then
/// moved.
std::vector<Move> rigid_patch(const std::vector<Vec3>& points, const Vec3& center, double radius, const Vec3& rotation,
                              const Vec3& by);
/// Points within `radius` of `center` go out along their normals by `distance`, fading like falloff_pull.
std::vector<Move> inflate(const field::Field& surface, const std::vector<Vec3>& points, const Vec3& center, double radius,
                          double distance);
/// Points within `radius` of `center` stay.
std::vector<Move> keep_fixed(const std::vector<Vec3>& points, const Vec3& center, double radius);

/// Adds the moves to a session as controls; returns their ids.
std::vector<std::size_t> add_moves(ControlSession& session, const std::vector<Move>& moves);

/// A closed surface in small pieces, and the volume it holds: the caller's sampler makes it at the field's present pose.
struct SurfaceElements {
  std::vector<Vec3> points;
  std::vector<double> areas;
  double volume = 0;
};
using MeasureSurface = std::function<SurfaceElements(const field::Field& surface)>;

/// What of the whole surface a goal is about.
enum class Measure {
  Area,    ///< world units squared
  Volume,  ///< world units cubed
};

struct GoalReport {
  bool reached = false;
  double value = 0;  ///< area or volume of the shape that is left
  int steps = 0;
};

/// Changes the unknowns as little as possible until the area or volume is `target`: Newton's method with the row
/// dV/dq = −∫ F_q/|∇F| dA, or dA/dq = −∫ κ F_q/|∇F| dA with κ = div n. `tolerance` is relative. If a step makes it no better
/// the shape before it is kept. Throws InvalidInput for a target that is not above zero.
GoalReport reach(field::Field& surface, Measure goal, double target, const MeasureSurface& measure, double tolerance = 1e-4,
                 const std::vector<std::string>& freeze = {});

}  // namespace meniscus::control
