#pragma once

#include <meniscus/pointset/point_set.h>

#include <cstdint>
#include <span>

namespace meniscus::pointset {

/// What the points around a point say about it. Private to the fit.

/// How far p ± d n may be from p so that no neighbour is nearer to them than p, each at most `longest`: the radii of the
/// largest empty balls that touch p from either side, a little less. [THEORY §6, Trap 8, in closed form]
struct SafeOffsets {
  double outer, inner;
};
SafeOffsets safe_offsets(const PointSet& set, std::size_t i, std::span<const std::uint32_t> neighbours, double longest);

/// Where the surface ends at an open border: a tangential vector of half a spacing's length, from the point into the widest
/// gap between its neighbours; zero when they stand all around it, or go on over a crease.
Vec3 border_at(const PointSet& set, std::size_t i, std::span<const std::uint32_t> neighbours);

}  // namespace meniscus::pointset
