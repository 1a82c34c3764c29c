#pragma once

#include <algorithm>
#include <cmath>

namespace meniscus::motion {

/// How far a direction of a linear problem is trusted, by its relative size: 0 up to `low`, 1 from `high` on, exactly, and
/// smooth in the logarithm in between.
struct Regular {
  double low;
  double high;

  double operator()(double size) const {
    if (!(size > low)) return 0;
    if (size >= high) return 1;
    const double t = std::log(size / low) / std::log(high / low);
    return t * t * (3 - 2 * t);
  }
};

}  // namespace meniscus::motion
