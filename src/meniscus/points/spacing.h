#pragma once

#include <meniscus/points/cloud.h>

namespace meniscus::points {

/// Typical distance of a point to its nearest neighbour, world units: the median over at most 10,000 points spread over the
/// cloud, coincident ones left out. 0 when no two points differ. Deterministic.
double typical_spacing(const Cloud& cloud);

}  // namespace meniscus::points
