#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/base/vec.h>
#include <meniscus/field/field.h>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace meniscus::motion {

/// What the tangential part of an implicit surface's velocity is; the normal part v_n = −F_t/|∇F| is always the surface's.
enum class Velocity {
  Normal,     ///< none
  Blended,    ///< that of the material velocity: the moving parts' weighted mean [SS11 §5]
  Total,      ///< such that the normal of a moving point does not turn [SS11 §4, (4.2)]
  Isometric,  ///< that of least strain: exact for every rigid motion
};

struct VelocityOptions {
  Velocity kind = Velocity::Blended;
  /// Length, world units, below which the surface is not looked at: where F's radius of curvature |∇F|/|H| is smaller, the
  /// point is `singular` and its normal speed at most |F_t|/(resolution |H|). Not given: 1e-4 of the diameter of the points.
  std::optional<double> resolution = {};
  /// Speed of the fastest primitive, world units per second: `Total` never has a tangential part more than twice as fast.
  /// Not given: the largest material speed at the points, which is a weighted mean of the primitives' and so never more
  /// than the fastest one's (the largest normal speed where nothing says how material moves).
  std::optional<double> fastest = {};
  /// Neighbours that a point of a set is fitted with for `Isometric`.
  std::size_t neighbours = 48;
};

/// Velocities at points, one entry per point everywhere.
struct Velocities {
  std::vector<Vec3> velocity;          ///< world units per second
  std::vector<Vec3> normal;            ///< unit ∇F; zero where F has none
  std::vector<double> normal_speed;    ///< v_n
  std::vector<double> distance;        ///< |F|/|∇F|; 0 where |∇F| is 0
  std::vector<double> confidence;      ///< 1: as defined; less: damped towards `Blended`; 0: wholly so, or singular
  std::vector<std::uint8_t> singular;  ///< the surface is about to meet or part here (or F is not finite): v_n is bounded
};

/// Velocities of the surface through every point (of the level set, for points off the surface). Batched and parallel; same
/// bits for any number of threads.
///
/// `Total` solves (4.2) in the eigenvectors of the tangent Hessian. A direction whose eigenvalue is below 0.1 |H| is mixed
/// with `Blended`, and below 0.01 |H| is `Blended` alone, smoothly in between: where Gaussian curvature vanishes the
/// condition says nothing. `Isometric` fits a rigid motion to v_n over each point's nearest neighbours, which must be those
/// of the same surface; directions that v_n does not determine (spheres, cylinders, planes) follow `Blended` in the same
/// way. On a mesh use IsometricSolver. Points where F is not finite get velocity zero.
/// Throws InvalidInput for a resolution or speed that is negative or not finite.
Velocities velocities(const field::Field& field, std::span<const Vec3> points, const VelocityOptions& options,
                      const RunControl& run = {});

/// Two unit vectors that with the unit vector `normal` form a right-handed frame. Deterministic.
void tangents(const Vec3& normal, Vec3& first, Vec3& second);

}  // namespace meniscus::motion
