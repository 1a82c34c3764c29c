#pragma once

#include <meniscus/io/format.h>

namespace meniscus::io {

class AtomicFile;

/// VTK's XML files with one piece: `.vtp` (PolyData) and `.vtu` (UnstructuredGrid) with point data; ascii, binary (base64)
/// and appended arrays, either byte order, plain or zlib-compressed. Cells as for legacy files.
RawGeometry read_vtk_xml(const Source& source, std::uint64_t memory_limit, ReadReport& report);

/// PolyData with triangles, or with one vertex cell a point for clouds. Appended raw data, or ascii with `options.text`.
void write_vtp(AtomicFile& file, const GeometryView& geometry, const WriteOptions& options);

}  // namespace meniscus::io
