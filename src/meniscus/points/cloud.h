#pragma once

#include <meniscus/base/attributes.h>
#include <meniscus/base/box.h>
#include <meniscus/base/vec.h>

#include <vector>

namespace meniscus::points {

/// A set of points with named attributes (see base/attributes.h for the canonical names and units).
struct Cloud {
  std::vector<Vec3> positions;  ///< world units
  Attributes attributes;        ///< one element per point each

  std::size_t size() const { return positions.size(); }
  bool empty() const { return positions.empty(); }
};

/// Smallest box that holds every point; empty for no points.
Box bounds(const Cloud& cloud);

/// The points `indices`, in that order, with their attributes.
Cloud gathered(const Cloud& cloud, std::span<const std::size_t> indices);

}  // namespace meniscus::points
