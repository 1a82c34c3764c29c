#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/polygonize/clipped_field.h>
#include <meniscus/polygonize/shell.h>

#include <vector>

namespace meniscus::polygonize {

struct BricksNear {
  std::vector<Coord> bricks;
  std::size_t boxes_tested = 0;
};

/// The bricks of the lattice that may hold a piece of the surface: all but those over which field.range() excludes a change
/// of sign. An octree over the lattice is descended level by level, so empty space costs nothing however large it is; where
/// range() says nothing, every brick comes back. Throws ResourceLimit when they hold more than max_cells cells.
BricksNear bricks_near(const ClippedField& field, const Lattice& lattice, std::size_t max_cells, const RunControl& run);

}  // namespace meniscus::polygonize
