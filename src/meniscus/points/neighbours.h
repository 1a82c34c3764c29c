#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/base/vec.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace meniscus::points {

/// A point found by a search.
struct Neighbour {
  std::uint32_t index;
  double squared_distance;

  bool operator==(const Neighbour&) const = default;
};

/// Finds the points of a set that are near a place. Answers come in order of distance, then of index, so they depend on the
/// points alone. Safe to ask from many threads. Points that are not finite are never found.
///
/// Cost: building O(n log n) and about 40 bytes a point; a question O(log n + answers), wherever stray points lie.
class NeighbourSearch {
 public:
  /// Copies the points. Throws ResourceLimit for more than 2^32 - 1 of them.
  explicit NeighbourSearch(std::span<const Vec3> points);
  ~NeighbourSearch();
  NeighbourSearch(NeighbourSearch&&) noexcept;
  NeighbourSearch& operator=(NeighbourSearch&&) noexcept;

  /// The `count` nearest to `place`, fewer when there are fewer; none for a place that is not finite. Replaces `result`.
  void nearest(const Vec3& place, std::size_t count, std::vector<Neighbour>& result) const;
  /// All with distance <= `radius`; none for a radius that is negative or NaN. Replaces `result`.
  void within(const Vec3& place, double radius, std::vector<Neighbour>& result) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

/// Lists of neighbours of many points: those of point i are index[begin[i]] … index[begin[i + 1] - 1], nearest first.
struct NeighbourLists {
  std::vector<std::size_t> begin{0};
  std::vector<std::uint32_t> index;

  std::size_t size() const { return begin.size() - 1; }
  std::span<const std::uint32_t> of(std::size_t i) const { return {index.data() + begin[i], begin[i + 1] - begin[i]}; }
};

/// The `count` nearest others of every point, in parallel: a point is not its own neighbour, one at the same place is.
NeighbourLists nearest_neighbours(std::span<const Vec3> points, std::size_t count, const RunControl& run = {});

/// The others within `radius` of every point. Throws InvalidInput unless radius >= 0.
NeighbourLists neighbours_within(std::span<const Vec3> points, double radius, const RunControl& run = {});

}  // namespace meniscus::points
