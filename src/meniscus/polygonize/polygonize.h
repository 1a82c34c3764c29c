#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/run_control.h>
#include <meniscus/field/field.h>
#include <meniscus/field/grid.h>
#include <meniscus/mesh/mesh.h>

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace meniscus::polygonize {

/// How finely to mesh. Lengths are world units.
struct PolygonizeOptions {
  /// Edge of a cell, > 0; cell i covers [i·voxel, (i+1)·voxel], wherever the surface is. Half the size: four times the
  /// triangles. Parts of the surface thinner than about one voxel may be missed.
  double voxel = 0;
  /// Where to mesh; field.bounds() when not given. A surface that leaves the box is closed at its faces.
  std::optional<Box> box = {};
  /// Newton steps tried per vertex before bisection; 0 leaves vertices at the mean of their cell's edge crossings.
  int projection = 12;
  /// Puts vertices where the surface has an edge or a corner onto it; otherwise these are cut off within a cell, and jagged.
  /// Needs projection.
  bool creases = true;
  /// Leaves the mesh open where the field jumps from one sign to the other without passing zero: the borders of an open
  /// point-set surface. Otherwise it is closed along the jump.
  bool open = false;
  /// Computes the attribute "N": unit ∇F; on creases the mean of the faces around.
  bool normals = true;
  /// Counts the components for the report: a tenth of the time or so.
  bool count_components = true;
  std::size_t max_cells = std::size_t{1} << 33;      ///< sampled ones; more is a ResourceLimit
  std::size_t max_triangles = std::size_t{1} << 30;  ///< more is a ResourceLimit
};

/// What happened.
struct PolygonizeReport {
  std::size_t boxes_tested = 0;  ///< calls of Field::range
  std::size_t cells_sampled = 0;
  std::size_t surface_cells = 0;      ///< of these, passed through by the surface
  std::size_t evaluations = 0;        ///< points at which the field was evaluated
  std::size_t nan_samples = 0;        ///< lattice points where F is NaN, counted as outside
  std::size_t vertices_at_box = 0;    ///< on the faces of the box
  std::size_t vertices_bisected = 0;  ///< where Newton's method failed and bisection found the surface
  std::size_t vertices_on_creases = 0;
  std::size_t vertices_moved = 0;      ///< taken off the surface, by 1e-4 voxel or more, to give a triangle area
  std::size_t triangles_on_jumps = 0;  ///< left out, see PolygonizeOptions::open
  double worst_residual = 0;           ///< largest |F|/|∇F| of vertices that were not bisected, voxels
  std::size_t components = 0;          ///< if asked for
  std::vector<std::string> warnings;   ///< sentences for the user
};

struct PolygonizeResult {
  mesh::Mesh mesh;
  PolygonizeReport report;
};

/// The surface F = 0 as a triangle mesh: dual marching cubes, one vertex for every loop in which the surface cuts a cell,
/// each moved onto the true surface.
///
/// Guarantees, whatever the field does: closed, manifold, oriented outward, finite; vertices within 1e-9 voxel of F = 0 (by
/// |F|/|∇F|, plus the rounding of their coordinates) or bisected to that width across a change of sign; same bits for any
/// number of threads. Every component of which some lattice point is inside is found, provided field.range() is right.
/// With `open` the mesh is that less the triangles on jumps. Zero and NaN at a lattice point count as outside. An empty
/// surface is an empty mesh. Cost: grows with the surface where field.range() excludes empty space, with the box where it
/// cannot; memory grows with the surface. Throws InvalidInput for a voxel or box that has no meaning or an unbounded field
/// without a box, ResourceLimit for more than 2³¹ cells along an axis or beyond the options' limits, Cancelled from `run`.
PolygonizeResult polygonize(const field::Field& field, const PolygonizeOptions& options, RunControl run = {});

struct PolygonizeGridOptions {
  bool normals = true;  ///< attribute "N": unit gradient of the trilinear interpolant
  bool count_components = false;
  std::size_t max_triangles = std::size_t{1} << 30;
};

/// The zero surface of a grid's trilinear interpolant. Guarantees as above, except that vertices stand on the interpolant to
/// second order; samples beyond the rim of the grid's bricks by more than a voxel count as outside.
PolygonizeResult polygonize_grid(const field::Grid& grid, const PolygonizeGridOptions& options = {}, RunControl run = {});

}  // namespace meniscus::polygonize
