#pragma once

#include <meniscus/base/vec.h>

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace meniscus::io {

/// Marks an index that does not fit; the common check after reading reports it.
inline std::int32_t vertex_index(std::int64_t index) {
  return index < 0 || index > std::numeric_limits<std::int32_t>::max() ? -1 : static_cast<std::int32_t>(index);
}

/// Adds a polygon as a fan of triangles about its first corner; fewer than three corners add nothing.
inline void add_polygon(std::span<const std::int64_t> corners, std::vector<Triangle>& triangles) {
  for (std::size_t i = 2; i < corners.size(); ++i)
    triangles.push_back({vertex_index(corners[0]), vertex_index(corners[i - 1]), vertex_index(corners[i])});
}

}  // namespace meniscus::io
