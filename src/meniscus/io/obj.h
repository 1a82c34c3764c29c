#pragma once

#include <meniscus/io/format.h>

namespace meniscus::io {

class AtomicFile;

/// Wavefront OBJ: `v` (with optional colour), `vn`, `f` with any number of corners and negative indices. Normals become the
/// attribute N when every vertex has one and the same normal in all its corners. Texture coordinates, groups and materials
/// are ignored. A file without faces is a cloud.
RawGeometry read_obj(const Source& source, ReadReport& report);

/// Positions with all digits of the precision, colours beside them, `vn` for N. Other attributes have no place in OBJ.
void write_obj(AtomicFile& file, const GeometryView& geometry, const WriteOptions& options);

}  // namespace meniscus::io
