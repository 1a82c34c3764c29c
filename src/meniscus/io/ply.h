#pragma once

#include <meniscus/io/format.h>

namespace meniscus::io {

class AtomicFile;

/// PLY 1.0: ascii, little- or big-endian. Scalar vertex properties become attributes; a file without faces is a cloud.
/// Elements other than `vertex` and `face` are skipped, with a warning.
RawGeometry read_ply(const Source& source, ReadReport& report);

/// Binary little-endian, or ascii with `options.text`.
void write_ply(AtomicFile& file, const GeometryView& geometry, const WriteOptions& options);

}  // namespace meniscus::io
