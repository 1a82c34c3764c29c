#pragma once

#include <meniscus/points/cloud.h>

namespace meniscus::points {

/// Typical distance of a point to its nearest neighbour, world units: the median over at most 10,000 points spread over the
/// cloud, coincident ones left out. 0 when no two points differ. Deterministic.
double typical_spacing(const Cloud& cloud);

/// Cube root of the volume a particle has where particles stand densest, world units: the spacing of a simulation that fills
/// space with equal particles. Particles of a liquid stand in disorder, so that their nearest neighbours are much nearer (by
/// a quarter in a splash). From the distances of the 9th to the 20th neighbour of at most 10,000 points, the lower decile of
/// them, so that sheets and spray do not count; never more than 1.8 typical spacings (what points without any order have),
/// which is what sheets and threads get. The typical spacing for fewer than 21 points. Deterministic.
double bulk_spacing(const Cloud& cloud);

}  // namespace meniscus::points
