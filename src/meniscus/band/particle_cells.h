#pragma once

#include <meniscus/base/box.h>

#include <cstdint>
#include <span>
#include <vector>

namespace meniscus::band {

/// Points sorted into cubic cells, for the question "which may lie within a cell's edge of this box?". Works at any extent:
/// only cells with points exist. Order depends on the points alone.
class ParticleCells {
 public:
  /// `cell` > 0: at least the largest distance that will be asked for. Points farther than 10⁶ cells from the first are
  /// left out (nothing of the surface can be there that a grid could hold) and counted.
  ParticleCells(std::span<const Vec3> points, double cell);

  /// Numbers of the points in the order of cells.
  const std::vector<std::uint32_t>& order() const { return order_; }
  double cell() const { return cell_; }
  std::size_t left_out() const { return left_out_; }

  /// Calls work(begin, end) for runs of order() that hold every point within a cell's edge of the box.
  template <class Work>
  void for_runs(const Box& box, const Work& work) const {
    for_runs(box, cell_, work);
  }
  /// The same for any reach >= 0; the runs hold more than that where cells are larger.
  template <class Work>
  void for_runs(const Box& box, double reach, const Work& work) const {
    const auto low = cell_of(box.min - Vec3::Constant(reach)), high = cell_of(box.max + Vec3::Constant(reach));
    for (std::int64_t x = low[0]; x <= high[0]; ++x)
      for (std::int64_t y = low[1]; y <= high[1]; ++y) {
        const auto [begin, end] = run(key(x, y, low[2]), key(x, y, high[2]));
        if (begin < end) work(begin, end);
      }
  }
  /// Boxes of the cells that hold points.
  std::vector<Box> boxes() const;

 private:
  static constexpr std::int64_t kHalf = 1 << 20;
  std::array<std::int64_t, 3> cell_of(const Vec3& p) const;
  static std::uint64_t key(std::int64_t x, std::int64_t y, std::int64_t z) {
    const auto u = [](std::int64_t v) { return static_cast<std::uint64_t>(v + kHalf); };
    return u(x) << 42 | u(y) << 21 | u(z);
  }
  /// Points of the cells with keys from first to last.
  std::pair<std::size_t, std::size_t> run(std::uint64_t first, std::uint64_t last) const;

  double cell_;
  Vec3 origin_ = Vec3::Zero();
  std::vector<std::uint32_t> order_;
  std::vector<std::uint64_t> keys_;   // of occupied cells, rising
  std::vector<std::uint32_t> begin_;  // first point of each, and the end
  std::size_t left_out_ = 0;
};

}  // namespace meniscus::band
