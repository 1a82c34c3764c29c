#pragma once

#include <meniscus/io/format.h>

namespace meniscus::io {

/// OFF in ascii: OFF, COFF (colours, 0 to 1 or 0 to 255), NOFF (normals), CNOFF. Colours of faces are ignored.
RawGeometry read_off(const Source& source, ReadReport& report);

}  // namespace meniscus::io
