#pragma once

#include <meniscus/io/format.h>

namespace meniscus::io {

/// Classic BGEO (version 5, big-endian): points with their attributes, and polygons when the file has nothing else.
/// Text attributes and primitives of other kinds are skipped, with a warning.
RawGeometry read_bgeo(const Source& source, ReadReport& report);

}  // namespace meniscus::io
