#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/run_control.h>
#include <meniscus/field/field.h>
#include <meniscus/sample/neighbour_grid.h>
#include <meniscus/sample/surface_points.h>

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace meniscus::sample {

/// What the tangent-plane Voronoi cell of one particle says (see SurfaceCell).
struct CellMeasure {
  double area = 0;
  double nearest = std::numeric_limits<double>::infinity();
  double farthest = 0;
  Vec3 corner = Vec3::Zero();
  bool open = false;
  double share = 1;          ///< of a full cell: 1/2 on a face of the box
  double local_spacing = 0;  ///< mean of the wanted spacings of the particle and its neighbours
  bool bent = false;  ///< the surface turns by more than 45° within the cell: its corners are no longer near the surface
};

inline constexpr double kCellLimit = 1.25;  ///< spacings at which cells are cut off

/// Neighbours as far as cells need them: within 2.5 spacings.
Neighbours cell_neighbours(const SurfacePoints& points, std::span<const double> spacing, const RunControl& run = {});

/// The cells of all points, or of those marked 1 in `asked`.
std::vector<CellMeasure> measure_cells(const SurfacePoints& points, std::span<const double> spacing,
                                       const Neighbours& neighbours, const Box& box, const RunControl& run = {},
                                       std::span<const std::uint8_t> asked = {});

/// How good a sampling is. Packing and covering are separate: the best packing is not the best covering. [THEORY §3]
/// Points on faces of the box hold half a cell and count as half a point in the lattice that distances are compared with.
/// With a density, distances are taken in local spacings, so the figures mean the same. Distances run along the surface
/// (arc_over_chord) and only between points of one sheet (same_sheet at least 1/2 for packing, above 0 for cover): the two
/// sides of a thin body are not neighbours however near they come.
struct Evenness {
  std::size_t count = 0;
  double area = 0;  ///< sum of the area elements
  std::size_t components = 0;
  double packing = 0;       ///< smallest distance of two neighbours / that of the hexagonal lattice, <= 1 but for small n
  double cover = 0;         ///< largest empty circle on the surface (find_holes) / the lattice's, >= 1 but for small n
  double cv = 0;            ///< standard deviation / mean of the distance to the nearest neighbour
  double max_distance = 0;  ///< largest |F| / |∇F|, world units
  std::size_t open = 0;     ///< particles with too few neighbours for a closed cell in their tangent plane
};

Evenness evenness(const field::Field& surface, const Box& box, const SurfacePoints& points, std::span<const double> spacing,
                  const RunControl& run = {});
/// The same from neighbours and cells that are there already.
Evenness evenness(const field::Field& surface, const Box& box, const SurfacePoints& points, std::span<const double> spacing,
                  const Neighbours& neighbours, std::span<const CellMeasure> cells, const RunControl& run = {});

/// Number of connected parts of the sampling: particles of one sheet within 1.7 spacings hang together.
std::size_t count_components(const SurfacePoints& points, std::span<const double> spacing, const Neighbours& neighbours);

}  // namespace meniscus::sample
