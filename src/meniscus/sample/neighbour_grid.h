#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/field/jets.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace meniscus::sample {

/// Who is near whom, compressed. Lists are symmetric: j is in the list of i exactly when i is in the list of j.
struct Neighbours {
  std::vector<std::size_t> first;    ///< where the list of particle i starts in `index`
  std::vector<std::uint32_t> count;  ///< its length
  std::vector<std::uint32_t> index;

  std::span<const std::uint32_t> of(std::size_t i) const { return {index.data() + first[i], count[i]}; }
  std::size_t size() const { return first.size(); }
};

/// Finds all pairs with |x_i − x_j| < max(reach_i, reach_j): two-sided, so a small particle finds the large ones that reach
/// it. A hierarchy of grids holds each particle at the level of its own reach; the cost is O(n + pairs) while reaches differ
/// by large factors. Coordinates must be finite, reaches positive. Order within a list is fixed: it depends on the input
/// alone. Same result for any thread count.
Neighbours find_neighbours(const field::Positions& x, std::span<const double> reach, const RunControl& run = {});

/// Indices of the points along a Z-order curve through cells of size `cell`: particles stored in this order find their
/// neighbours close by in memory. Deterministic; O(n).
std::vector<std::uint32_t> spatial_order(const field::Positions& x, double cell);

}  // namespace meniscus::sample
