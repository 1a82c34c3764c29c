#pragma once

#include <meniscus/mesh/mesh.h>

#include <cstdint>
#include <span>

namespace meniscus::scene {

/// Attributes for vertices at `positions`, the first of which are these vertices of `old`: those keep theirs, the others
/// take the values of the nearest place of the old mesh, interpolated in its triangle (integers: of the nearest vertex).
Attributes inherited(const mesh::Mesh& old, std::span<const std::int32_t> kept, std::span<const Vec3> positions);

}  // namespace meniscus::scene
