#pragma once

#include <meniscus/base/function_ref.h>
#include <meniscus/polygonize/polygonize.h>
#include <meniscus/polygonize/shell.h>

#include <span>

namespace meniscus::polygonize {

struct FinishOptions {
  std::size_t max_triangles = 0;
  bool count_components = false;
  bool normals = true;  ///< keep the shell's
};

/// Brings these vertices back into their own cells; may do nothing.
using Settle = FunctionRef<void(Shell& shell, std::span<const std::size_t> vertices)>;

/// Connects the shell's vertices, moves those of triangles without area apart (first by `settle`, which keeps them on the
/// surface, then at any price), and makes it a mesh. Fills in the report.
mesh::Mesh finish(Shell shell, const FinishOptions& options, Settle settle, PolygonizeReport& report, const RunControl& run);

}  // namespace meniscus::polygonize
