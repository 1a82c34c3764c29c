#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/run_control.h>
#include <meniscus/field/field.h>
#include <meniscus/sample/evenness.h>
#include <meniscus/sample/neighbour_grid.h>
#include <meniscus/sample/surface_points.h>

#include <cstdint>
#include <span>
#include <vector>

namespace meniscus::sample {

/// An empty circle on the surface.
struct Hole {
  Vec3 center, normal;         ///< on the surface to 1e-9 of a spacing
  double radius = 0;           ///< distance along the surface to the nearest particle of the same sheet, in local spacings
  std::uint32_t particle = 0;  ///< in whose cell it was found
};

/// The largest empty circle about each particle whose radius is at least `least` local spacings, by falling radius.
/// Where the surface is nearly flat these are corners of the cells. Where it bends within a spacing (or a cell has no end)
/// every corner is reached by a walk along the surface and brought to the middle of its three nearest particles, so that a
/// rim or the far side of a thin body counts with its own points and no place off the surface counts at all.
/// `neighbours` and `cells`: of the same points (evenness.h). Deterministic.
std::vector<Hole> find_holes(const field::Field& surface, const Box& box, const SurfacePoints& points,
                             std::span<const double> spacing, const Neighbours& neighbours,
                             std::span<const CellMeasure> cells, double least, const RunControl& run = {});

}  // namespace meniscus::sample
