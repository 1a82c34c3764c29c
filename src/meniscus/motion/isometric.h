#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/mesh/mesh.h>
#include <meniscus/motion/velocity.h>

#include <memory>
#include <span>
#include <vector>

namespace meniscus::motion {

/// The velocity field on a mesh that has given normal speeds and strains the mesh least (as Killing as possible):
/// minimises Σ A |ε|² over the triangles, ε the rate of strain within a triangle's plane. A triangle resists being flattened
/// the more the thinner it is; one whose corners' normals are over 60° apart holds a crease and does not resist.
///
/// What strain leaves open (turning a sphere, sliding along a cylinder) follows a guide, the blended velocity: the
/// energy has the term 1e-5 Σ A_i |t_i − guide_i|²/A added, A the whole area, and its bias is taken away again by four
/// rounds of iterated Tikhonov regularisation: a rigid motion comes out to 1e-8 wherever the shape determines it.
///
/// Each round is solved by conjugate gradients, preconditioned by a sparse LDLᵀ factorisation of the same energy, which
/// costs about O(V^1.5). It is kept while the mesh moves as one body, and made again when three iterations do not do.
/// Deterministic: the result depends on the arguments and factorised_at() alone.
class IsometricSolver {
 public:
  /// For meshes with these triangles. Throws InvalidInput for an index out of range.
  explicit IsometricSolver(const mesh::Mesh& mesh);
  ~IsometricSolver();
  IsometricSolver(IsometricSolver&&) noexcept;
  IsometricSolver& operator=(IsometricSolver&&) noexcept;

  /// A shape of the mesh: positions and unit normals of its vertices.
  struct Shape {
    std::vector<Vec3> positions, normals;
  };
  /// Where the factorisation was made; empty before the first.
  const Shape& factorised_at() const;
  /// Makes it there. Throws InvalidInput for a wrong count.
  void factorise(Shape shape);

  /// Replaces the tangential parts of `v` (velocities of kind Blended at `positions`, the guide) by those of least strain.
  /// Returns the root mean square of |ε| by area, per second; leaves `v` as it is, confidence 0, if the system cannot be
  /// factorised (no area, positions that are not finite).
  double solve(std::span<const Vec3> positions, Velocities& v, const RunControl& run = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace meniscus::motion
