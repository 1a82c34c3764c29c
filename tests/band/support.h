#pragma once

#include <meniscus/band/band.h>
#include <meniscus/band/components.h>
#include <meniscus/field/primitives.h>

#include <cmath>
#include <numbers>
#include <vector>

namespace meniscus::band::test {

/// The band of a sphere.
inline Band ball(double voxel, const Vec3& center, double radius) {
  const auto sphere = field::sphere({center.x(), center.y(), center.z()}, radius);
  return band_of(*sphere, voxel);
}

inline double total_volume(const Band& band) {
  double v = 0;
  for (const Component& c : measure_components(band, label_components(band))) v += c.volume;
  return v;
}

inline double radius_of(double volume) { return std::cbrt(3 * volume / (4 * std::numbers::pi)); }

/// FNV-1a over samples and bricks.
inline std::uint64_t fingerprint(const Band& band) {
  std::uint64_t h = 14695981039346656037ull;
  const auto add = [&](const void* p, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i) h = (h ^ static_cast<const unsigned char*>(p)[i]) * 1099511628211ull;
  };
  add(band.values().data(), band.values().size_bytes());
  add(band.bricks().data(), band.bricks().size() * sizeof(Coord));
  return h;
}

}  // namespace meniscus::band::test
