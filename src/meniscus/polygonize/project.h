#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/polygonize/clipped_field.h>
#include <meniscus/polygonize/shell.h>

#include <span>

namespace meniscus::polygonize {

struct ProjectOptions {
  int iterations = 12;      ///< Newton steps tried per vertex before bisection; 0 leaves the vertices where they are
  double tolerance = 1e-9;  ///< wanted |F|/|∇F|, voxels
  bool normals = true;
};

struct ProjectReport {
  std::size_t evaluations = 0;
  std::size_t bisected = 0;   ///< vertices for which Newton's method failed
  std::size_t at_box = 0;     ///< vertices on the faces of the box
  std::size_t creases = 0;    ///< vertices on creases
  double worst_residual = 0;  ///< largest |F|/|∇F| of vertices not bisected, voxels
};

/// Both together. Counts are differences, taken modulo 2⁶⁴ where a stage takes back what an earlier one counted.
ProjectReport sum(ProjectReport a, const ProjectReport& b);

/// |F|/|∇F| allowed at p: `tolerance` voxels and the rounding of its coordinates.
double surface_tolerance(const Lattice& lattice, double tolerance, const Vec3& p);

/// Moves the shell's vertices onto F = 0 and fills shell.normals with unit ∇F (zero where it vanishes)
/// and shell.placed.
/// Newton's method along the gradient, a step only if |F| falls and stays about the vertex's cell; failing that, bisection
/// towards the nearest corner of the vertex's cell that lies on the other side, which cannot fail.
ProjectReport project(const ClippedField& field, Shell& shell, const ProjectOptions& options, const RunControl& run);

/// Bisects these vertices between the middle of their cell and a corner on the other side: on F = 0 and in their own cell,
/// where no vertex of another cell is but by chance. Keeps normals up to date.
void settle_in_cells(const ClippedField& field, Shell& shell, std::span<const std::size_t> vertices, ProjectReport& report);

}  // namespace meniscus::polygonize
