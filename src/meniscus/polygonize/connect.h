#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/base/vec.h>
#include <meniscus/polygonize/shell.h>

#include <cstdint>
#include <vector>

namespace meniscus::polygonize {

struct Connection {
  std::vector<Triangle> triangles;      ///< by brick, cell and axis; outward
  std::vector<std::size_t> degenerate;  ///< vertices of triangles with (next to) no area, rising, each once
};

/// Joins the vertices around every crossed lattice edge to a polygon and cuts it into triangles: four-sided ones along the
/// diagonal that gives the better triangles at the vertices' present positions. The result is closed, oriented and
/// manifold for any samples whatever. Same bits for any number of threads; linear cost.
/// Throws ResourceLimit for more than max_triangles.
Connection connect(const Shell& shell, std::size_t max_triangles, const RunControl& run);

/// The vertices of triangles without area (their height is some 1e-7 of the longest side, or less), rising.
std::vector<std::size_t> without_area(const Shell& shell, const std::vector<Triangle>& triangles);

}  // namespace meniscus::polygonize
