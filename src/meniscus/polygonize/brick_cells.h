#pragma once

#include <meniscus/polygonize/shell.h>

#include <array>
#include <cstdint>
#include <vector>

namespace meniscus::polygonize {

/// Which lattice points of a brick are inside: one row of 9 bits along z per (x, y). Zero and NaN are outside.
struct SignRows {
  std::array<std::uint16_t, 81> row;

  /// Fills the rows; false when all signs agree.
  bool read(const double* values);
  std::uint16_t at(int i, int j) const { return row[static_cast<std::size_t>(i * kBrickPoints + j)]; }
};

/// Cells and vertices of several bricks, one after the other.
struct BrickCells {
  std::vector<SurfaceCell> cells;
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;
};

/// Finds the surface's cells in a brick and their vertices; completes `brick` (counted from the start of `out`).
void append_cells(const Lattice& lattice, const SignRows& rows, const double* values, bool trilinear, SurfaceBrick& brick,
                  BrickCells& out);

/// Appends the bricks, other than this one, whose cells use an edge of this brick that the surface crosses.
void append_reached(const SignRows& rows, const Coord& brick, std::vector<Coord>& reached);

/// One of the vertices that a cell owns: the crossed edges (bits) it stands for, and the axis of its split face or -1.
struct CellVertex {
  unsigned edges = 0;
  int split_axis = -1;
};
CellVertex cell_vertex(const CellCase& kind, int number);

}  // namespace meniscus::polygonize
