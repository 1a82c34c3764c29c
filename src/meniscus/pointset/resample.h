#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/points/neighbours.h>
#include <meniscus/pointset/point_set.h>

#include <cstdint>
#include <span>
#include <vector>

namespace meniscus::pointset {

/// A place near the surface where points are missing, and the point whose neighbour it is.
struct Gap {
  Vec3 place;
  std::uint32_t like;
};

/// Gaps around the points `about`: each projects its neighbours on its tangent plane; the vertex of its Voronoi cell with
/// the largest empty circle is a gap if that radius is 0.95 to 1.6 spacings and points stand all around it: at an open
/// border they do not, or borders would grow for ever. No two gaps are nearer than 0.7 · spacing. `search` knows the set's
/// positions. Deterministic for any number of threads. [THEORY §6, Resampling]
std::vector<Gap> find_gaps(const PointSet& set, const points::NeighbourSearch& search, std::span<const std::uint32_t> about,
                           double spacing, const RunControl& run = {});

/// Those of the points `about` that have another of their own sheet nearer than 0.62 of the spacing, so many that without
/// them none has. In rising order.
std::vector<std::uint32_t> find_crowded(const PointSet& set, const points::NeighbourSearch& search,
                                        std::span<const std::uint32_t> about, double spacing);

}  // namespace meniscus::pointset
