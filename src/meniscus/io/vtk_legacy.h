#pragma once

#include <meniscus/io/format.h>

namespace meniscus::io {

/// Legacy VTK files up to version 5.1, ascii or binary (big-endian): POLYDATA and UNSTRUCTURED_GRID with point data.
/// Triangles, quads, polygons, pixels and strips become triangles; vertices alone make a cloud; lines, solids and cell data
/// are skipped.
RawGeometry read_vtk_legacy(const Source& source, ReadReport& report);

}  // namespace meniscus::io
