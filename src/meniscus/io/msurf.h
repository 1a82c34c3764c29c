#pragma once

#include <meniscus/io/format.h>
#include <meniscus/pointset/boolean.h>

namespace meniscus::io {

/// Point-set surfaces as they are, `.msurf`: fitted functions and all, and Booleans of them with their edges sharp. Little
/// endian; the layout stands in docs/formats.md. Reading back gives every bit.
///
/// Reads a solid. Throws IoError with the byte for anything that is not a sound file of a known version.
pointset::Solid read_msurf(const std::string& path, const ReadOptions& options = {});
pointset::Solid read_msurf_bytes(const Source& source);

/// Writes a solid, whole or not at all. Throws IoError of kind Write, InvalidInput for one whose parts do not fit together.
void write_msurf(const std::string& path, const pointset::Solid& solid, const WriteOptions& options = {});

/// The points of the solid in a file, for readers of clouds.
RawGeometry read_msurf_points(const Source& source);
bool looks_like_msurf(std::string_view bytes);

}  // namespace meniscus::io
