#pragma once

#include <meniscus/base/vec.h>

namespace meniscus::render {

/// How a scalar becomes a colour.
enum class ColorMap {
  Sequential,  ///< dark violet, blue, green, yellow: for magnitudes
  Diverging,   ///< blue, light grey, red: for signed values about the middle of the range
};

/// Linear RGB of `t`, which is clamped to [0, 1]; NaN gives grey. Lightness (OKLab L) is linear in t for Sequential, and
/// linear from either end to the middle for Diverging, so equal steps of the value look equal.
Vec3 color_of(ColorMap map, double t);

/// OKLab lightness in [0, 1] of a linear RGB colour (Ottosson 2020).
double lightness(const Vec3& linear_rgb);

}  // namespace meniscus::render
