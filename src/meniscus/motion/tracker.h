#pragma once

#include <meniscus/base/function_ref.h>
#include <meniscus/base/run_control.h>
#include <meniscus/mesh/adjacency.h>
#include <meniscus/mesh/mesh.h>
#include <meniscus/motion/isometric.h>
#include <meniscus/motion/velocity.h>
#include <meniscus/points/cloud.h>

#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace meniscus::motion {

/// How positions follow velocities over a step.
enum class Integrator {
  Euler,       ///< as in the paper
  Heun,        ///< second order; looks at both ends of a step only
  RungeKutta4  ///< needs the field in the middle of a step as well
};

/// The field posed at a time, seconds. The reference holds until the next call.
using PoseAt = FunctionRef<const field::Field&(double)>;

struct TrackerOptions {
  VelocityOptions velocity;
  Integrator integrator = Integrator::Heun;
  int fairing = 0;  ///< rounds a step, meshes only: springs along edges, in the tangent plane, at rest in the first mesh
};

/// What a step did.
struct StepReport {
  double area_log_mean = 0;  ///< mean over triangles of |log(A/A₀)|, A₀ the first mesh's
  double area_log_max = 0;   ///< the worst of them, at most log(1e12)
  std::size_t flips = 0;     ///< triangles that face against ∇F
  double max_distance = 0;   ///< largest |F|/|∇F| at the end, world units
  std::size_t lost = 0;  ///< points whose way back to the surface was longer than allowed; they stay where they were sent
  std::size_t singular = 0;  ///< see Velocities
  double seconds_velocity = 0;
  double seconds_fairing = 0;
};

/// Moves points onto F = 0 by x ← x − F ∇F/|∇F|² [SS11 (4.3)], each at most `reach[i]` in all. A point that would have to go
/// farther has lost its sheet and is left where it was. Returns the number of these; `lost`, if given, says which.
std::size_t project(const field::Field& field, std::vector<Vec3>& points, std::span<const double> reach,
                    const RunControl& run = {}, std::vector<std::uint8_t>* lost = nullptr);

/// Evens out a mesh on its surface: `rounds` of uniform Laplacian fairing in the tangent plane, each followed by a
/// projection. The first `fixed` vertices stay where they are.
void fair(const field::Field& field, mesh::Mesh& mesh, int rounds, const RunControl& run = {}, std::size_t fixed = 0);

/// What later steps depend on beside the mesh of the moment: what distortion is measured against and fairing goes back to
/// (the mesh as it was when tracking began), and what the solver remembers.
struct References {
  std::vector<double> lengths;             ///< of the edges at each vertex, vertex by vertex, by rising neighbour
  std::vector<double> areas;               ///< of triangles
  std::vector<Vec3> velocity;              ///< of the vertices, as the last step left it
  IsometricSolver::Memory isometric = {};  ///< empty for other velocities
};

/// Attribute of tracked meshes and points: 1 where Velocities::singular holds, so that v_n is bounded and not exact.
inline constexpr std::string_view kSingular = "singular";

/// Carries the vertices of a mesh along a moving surface. Connectivity and attributes stay; attributes "N" (unit normal),
/// "v" (world units per second) and "singular" are those of the vertices as they are now.
class MeshTracker {
 public:
  /// `mesh` lies on the surface of `field` as posed at time `time`.
  MeshTracker(mesh::Mesh mesh, const field::Field& field, double time, const TrackerOptions& options,
              const RunControl& run = {});

  /// Moves to time `to`: integration, projection, fairing. `pose` is asked for times from time() to `to`, `to` last.
  /// Throws InvalidInput unless `to` is finite.
  StepReport advance(PoseAt pose, double to, const RunControl& run = {});

  /// Goes on with `mesh`, which lies on the surface of `field` and begins with these vertices and triangles of mesh(), in
  /// rising order: their edges and triangles keep the first mesh's lengths and areas, the others' are measured now.
  void replace(mesh::Mesh mesh, std::span<const std::int32_t> kept_vertices, std::span<const std::int32_t> kept_triangles,
               const field::Field& field, const RunControl& run = {});

  References references() const;
  /// Goes on as an earlier tracker with the same mesh and these references would have. Throws InvalidInput for a wrong
  /// count.
  void set_references(References references);

  const mesh::Mesh& mesh() const { return mesh_; }
  const Velocities& velocities() const { return velocities_; }
  /// Vertices that the last step lost.
  const std::vector<std::uint8_t>& lost() const { return lost_; }
  double time() const { return time_; }
  /// The measures of the mesh as it is, without those of a step.
  StepReport measures() const;

 private:
  Velocities evaluate(const field::Field& field, std::span<const Vec3> x, const RunControl& run);
  std::vector<double> half_ring_lengths() const;
  void spring_round(const field::Field& field, const RunControl& run);
  void measure_references();
  void write_attributes();

  mesh::Mesh mesh_;
  TrackerOptions options_;
  double time_;
  mesh::IndexLists neighbours_;
  References references_;  // lengths are parallel to neighbours_.items
  std::optional<IsometricSolver> solver_;
  Velocities velocities_;
  std::vector<std::uint8_t> lost_;
};

/// The same for points without connectivity.
class PointTracker {
 public:
  /// `spacing`, world units: how far apart the points are; a point may be projected by half of it, or by its step.
  PointTracker(points::Cloud cloud, const field::Field& field, double time, double spacing, const TrackerOptions& options,
               const RunControl& run = {});
  /// Points that lose their sheet are taken out, with their attributes; `lost` counts them.
  StepReport advance(PoseAt pose, double to, const RunControl& run = {});
  const points::Cloud& cloud() const { return cloud_; }
  const Velocities& velocities() const { return velocities_; }
  double time() const { return time_; }
  /// The measures of the points as they are, without those of a step.
  StepReport measures() const;

 private:
  void write_attributes();

  points::Cloud cloud_;
  TrackerOptions options_;
  double time_;
  double spacing_;
  Velocities velocities_;
};

}  // namespace meniscus::motion
