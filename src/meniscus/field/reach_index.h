#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/function_ref.h>
#include <meniscus/field/jets.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace meniscus::field {

/// Answers which of many spheres may reach a point, at a cost that does not grow with their number.
///
/// Spheres are binned by size into levels a factor of two apart; at each level they are sorted by the grid cell of their
/// centre, with cells half as wide as the level's largest radius, so a point needs the 5×5×5 cells around its own.
/// The order of candidates depends on the point's cell alone: sums over them have the same bits in any batch.
class ReachIndex {
 public:
  /// Cell of a point at the finest level; points of one cell have the same candidates.
  using Cell = std::array<std::int64_t, 3>;
  /// Positions [begin, end) in order().
  struct Range {
    std::uint32_t begin;
    std::uint32_t end;
  };

  ReachIndex() = default;
  /// Spheres with centres (x, y, z) and radii `reach`; those of radius <= 0 or not finite are left out.
  ReachIndex(std::span<const double> x, std::span<const double> y, std::span<const double> z, std::span<const double> reach);

  /// Which sphere stands at each position of the sorted order.
  std::span<const std::uint32_t> order() const { return order_; }
  /// Box of all spheres.
  const Box& bounds() const { return bounds_; }
  /// The cell of a point inside bounds().
  Cell cell(const Vec3& p) const;
  /// Appends the candidates of the points in `cell`, in a fixed order.
  void candidates(const Cell& cell, std::vector<Range>& out) const;
  /// Calls visit(candidates, numbers of points) for groups of points that share their candidates; points that nothing
  /// reaches come with no candidates. Makes work on many points at once as good as their order allows.
  void for_groups(const Positions& x,
                  FunctionRef<void(std::span<const Range> candidates, std::span<const std::uint32_t> points)> visit) const;
  /// Appends the spheres that may overlap `box`; returns false, with nothing useful in `out`, when there are more than
  /// `most`.
  bool overlapping(const Box& box, std::size_t most, std::vector<Range>& out) const;

 private:
  struct Level {
    int shift;  // cells are 2^shift times as wide as the finest
    double cell;
  };
  struct Row {  // spheres of one column of cells
    std::int64_t level = -1, x = 0, y = 0;
    Range range{0, 0};
  };
  const Row* find_row(std::int64_t level, std::int64_t x, std::int64_t y) const;
  void append(const Row& row, std::int64_t z_min, std::int64_t z_max, std::vector<Range>& out) const;
  void build_rows(const std::vector<std::array<std::int64_t, 4>>& keys);
  static std::uint64_t hash(std::int64_t level, std::int64_t x, std::int64_t y);

  std::vector<std::uint32_t> order_;
  std::vector<std::int64_t> z_;  // cell z of each position
  std::vector<Row> rows_;        // in order
  std::vector<std::uint32_t> table_;
  std::vector<Level> levels_;
  double finest_ = 1;
  Box bounds_;
};

}  // namespace meniscus::field
