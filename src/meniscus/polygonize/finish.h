#pragma once

#include <meniscus/polygonize/polygonize.h>
#include <meniscus/polygonize/shell.h>

namespace meniscus::polygonize {

/// Connects the shell's vertices, moves those of triangles without area apart, and makes it a mesh. Fills in the report.
mesh::Mesh finish(Shell shell, std::size_t max_triangles, bool count_components, PolygonizeReport& report,
                  const RunControl& run);

}  // namespace meniscus::polygonize
