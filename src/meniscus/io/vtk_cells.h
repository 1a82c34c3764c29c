#pragma once

#include <meniscus/base/vec.h>

#include <cstdint>
#include <span>
#include <vector>

namespace meniscus::io {

/// VTK's cell types that matter for surfaces and particles.
enum class VtkCell : std::int64_t { Vertex = 1, PolyVertex = 2, Triangle = 5, Strip = 6, Polygon = 7, Pixel = 8, Quad = 9 };

/// Adds a cell's triangles; false for cells without surface that are not vertices either (lines, solids).
bool add_vtk_cell(VtkCell type, std::span<const std::int64_t> corners, std::vector<Triangle>& triangles);

}  // namespace meniscus::io
