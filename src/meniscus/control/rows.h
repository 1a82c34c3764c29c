#pragma once

#include <meniscus/field/field.h>

#include <optional>
#include <string>
#include <vector>

namespace meniscus::control {

/// The rows F_q of points, divided by |∇F|: entry k says how far the surface retreats from the point, world units, per unit
/// of unknown k.
struct SurfaceRows {
  field::SparseRows rows;
  std::vector<double> distance;  ///< F/|∇F|: signed distance to first order, never beyond the length scale
  std::vector<Vec3> normal;      ///< zero where ∇F vanishes
};

/// `length` is the scale of the shape, world units, > 0: where |∇F| is below |F|/length it is no measure of distance and
/// |F|/length takes its place. Rows of points where F is not finite or constant are empty.
SurfaceRows surface_rows(const field::Field& surface, const std::vector<Vec3>& points, double length);

/// The distances of surface_rows alone.
std::vector<double> surface_distance(const field::Field& surface, const std::vector<Vec3>& points, double length);

/// The size of change of each unknown that moves the surface by about one unit of length: the metric of a control system.
/// Coordinates and lengths count as they are. Weights, angles and ratios share one scale each, such that the most effective
/// one moves the surface at `points` by one; plain numbers get one each. So no result depends on an unknown's unit.
/// Unknowns named in `freeze` (a name, or all below it) get 0. Throws InvalidInput, with a suggestion, for a name that is
/// none.
std::vector<double> sensitivity_scale(const field::Field& surface, const SurfaceRows& points,
                                      const std::vector<std::string>& freeze = {});

/// The same from how far one unit of each unknown moves the surface on the whole: its root mean square over `samples`, rows
/// of points spread evenly over the surface. What bulges everywhere, such as a radius, then costs more than what moves a
/// tip. No unknown counts as less effective than a twentieth of the most effective one of its kind.
std::vector<double> surface_scale(const field::Field& surface, const SurfaceRows& samples,
                                  const std::vector<std::string>& freeze = {});

/// How far the unknowns may go from their present values in a step; sizes that must stay above zero keep a thousandth.
struct StepBounds {
  std::vector<double> lower, upper;
};
StepBounds step_bounds(const field::Field& surface);

/// The point of the surface that Newton's steps along ∇F reach from `point`, or nothing when they do not settle.
std::optional<Vec3> nearest_surface_point(const field::Field& surface, const Vec3& point, double length);

/// The surface's bounds without what Field::range shows to be outside, side by side, to about 1 %; infinite ones as they
/// are.
Box tight_bounds(const field::Field& surface);

/// A length to measure against: the diameter of the surface's tight bounds, of `points` when they are infinite, or 1.
double length_scale(const field::Field& surface, const std::vector<Vec3>& points);

}  // namespace meniscus::control
