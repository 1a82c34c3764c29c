#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/mesh/mesh.h>
#include <meniscus/motion/velocity.h>

#include <memory>
#include <span>
#include <vector>

namespace meniscus::motion {

/// The velocity field on a mesh that has given normal speeds and strains the mesh least (as Killing as possible):
/// minimises Σ A |ε|² over the triangles that resist (strain.h), ε the rate of strain within a triangle's plane.
///
/// Every part of the mesh is first given the rigid motion that suits its normal speeds (rigid_parts.h); what normal speeds
/// do not tell of it (turning a sphere, sliding along a cylinder) follows a guide, the blended velocity. A part that moves
/// as one body is done with: its motion comes out to rounding, at linear cost. What the others have beyond that is solved
/// for by conjugate gradients, to a thousandth, from the last solution on, preconditioned by a sparse factorisation of the
/// same energy (strain_factor.h), which is made again when twelve iterations do not do. Deterministic: the result depends on
/// the arguments and memory() alone.
class IsometricSolver {
 public:
  /// For meshes with these triangles. Throws InvalidInput for an index out of range.
  explicit IsometricSolver(const mesh::Mesh& mesh);
  ~IsometricSolver();
  IsometricSolver(IsometricSolver&&) noexcept;
  IsometricSolver& operator=(IsometricSolver&&) noexcept;

  /// What a solve leaves for the next.
  struct Memory {
    std::vector<Vec3> positions, normals;  ///< of the vertices, where the factorisation was made; empty before the first
    std::vector<double> tangential;        ///< the last solution, in frames that turn with the mesh: two numbers a vertex
  };
  const Memory& memory() const;
  /// Goes on as the solver with that memory would have. Throws InvalidInput for a wrong count.
  void recall(Memory memory);

  /// Replaces the tangential parts of `v` (velocities of kind Blended at `positions`, the guide) by those of least strain.
  /// Returns the root mean square of |ε| by area, per second; leaves `v` as it is, confidence 0, if the system cannot be
  /// solved (positions that are not finite).
  double solve(std::span<const Vec3> positions, Velocities& v, const RunControl& run = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace meniscus::motion
