#pragma once

#include <meniscus/io/format.h>

namespace meniscus::io {

class AtomicFile;

/// STL, binary or ascii. Corners at exactly the same position become one vertex; the file's facet normals are ignored (they
/// follow from the corners).
RawGeometry read_stl(const Source& source, ReadReport& report);

/// Binary (floats, as the format has it), or ascii with `options.text`. Attributes have no place in STL.
void write_stl(AtomicFile& file, const GeometryView& geometry, const WriteOptions& options);

}  // namespace meniscus::io
