#include <meniscus/pointset/grid_update.h>

#include <meniscus/base/parallel.h>
#include <meniscus/pointset/local_spline.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace meniscus::pointset {
namespace {

constexpr std::size_t kBlock = 16;
constexpr int kNewtonSteps = 3;
constexpr double kFarthest = 0.5;  // of the reach, in one update
constexpr double kSettled = 1e-3;  // of the reach: |s|/|∇s| of a point that is on the surface
constexpr double kNothing = 1e-7;  // of the voxel: what counts as no change

template <int G>
class Follower {
 public:
  using Spline = LocalSpline<G>;
  using Samples = typename Spline::Samples;

  Follower(PointSet& set, const SculptGrid& grid, double seconds) : set_(set), grid_(grid), seconds_(seconds) {}

  /// Moves point i; how far, or nothing when the surface is out of its reach.
  std::optional<double> follow(std::size_t i) {
    const Vec3 start = set_.position(i);
    const double reach = set_.reach[i];
    const Mat3 axes = sample_axes(set_.normal(i), reach);
    if (!sample(start, axes, true)) return 0;
    const Samples p = Spline::solved(values_), rate = Spline::solved(rates_);

    // ẋ·n = −(∇_p s · ṗ) / |∇_x s|, then Newton's method; in local coordinates, whose unit is the reach.
    auto jet = Spline::at(p, Vec3::Zero());
    double slope2 = jet.gradient.squaredNorm();
    if (!(slope2 > 0)) return std::nullopt;
    Vec3 local = within(-seconds_ * Spline::at(rate, Vec3::Zero()).value / slope2 * jet.gradient);
    for (int k = 0; k < kNewtonSteps; ++k) {
      jet = Spline::at(p, local);
      slope2 = jet.gradient.squaredNorm();
      if (!(slope2 > 0)) return std::nullopt;
      local = within(local - jet.value / slope2 * jet.gradient);
    }
    jet = Spline::at(p, local);
    if (!(std::abs(jet.value) < kSettled * jet.gradient.norm())) return std::nullopt;

    const Vec3 place = start + axes * local, normal = (axes * jet.gradient).normalized();
    sample(place, sample_axes(normal, reach), false);
    set_.set_position(i, place);
    set_.set_normal(i, normal);
    const Samples now = Spline::solved(values_);
    std::copy(now.begin(), now.end(), set_.coefficients_of(i).begin());
    return (place - start).norm();
  }

 private:
  static Vec3 within(const Vec3& local) {
    const double far = local.norm();
    return far > kFarthest ? Vec3(kFarthest / far * local) : local;
  }

  /// Fills values_ (and rates_); with rates, says whether anything has changed here.
  bool sample(const Vec3& place, const Mat3& axes, bool rates) {
    double fastest = 0;
    std::size_t k = 0;
    for (int a = 0; a < G; ++a)
      for (int b = 0; b < G; ++b)
        for (int c = 0; c < G; ++c, ++k) {
          const Vec3 local(Spline::place(a), Spline::place(b), Spline::place(c));
          const SculptGrid::Cell cell = grid_.cell(place + axes * local);
          values_[k] = grid_.at(cell, grid_.value());
          if (!rates) continue;
          rates_[k] = grid_.at(cell, grid_.rate());
          fastest = std::max(fastest, std::abs(rates_[k]));
        }
    return seconds_ * fastest > kNothing * grid_.voxel();
  }

  PointSet& set_;
  const SculptGrid& grid_;
  double seconds_;
  Samples values_{}, rates_{};
};

template <int G>
GridUpdate follow_all(PointSet& set, std::span<const std::uint32_t> touched, const SculptGrid& grid, double seconds,
                      const RunControl& run) {
  std::vector<double> moved(touched.size());
  parallel_blocks(touched.size(), kBlock, run, [&](std::size_t begin, std::size_t end) {
    Follower<G> follower(set, grid, seconds);
    for (std::size_t k = begin; k < end; ++k) moved[k] = follower.follow(touched[k]).value_or(-1);
  });
  GridUpdate update;
  for (const double m : moved) {
    update.moved += m > 0;
    update.lost += m < 0;
    update.farthest = std::max(update.farthest, m);
  }
  return update;
}

}  // namespace

std::vector<std::uint32_t> points_inside(const PointSet& set, const Box& box) {
  std::vector<std::uint32_t> found;
  for (std::size_t i = 0; i < set.size(); ++i)
    if (box.contains(set.position(i)) && box.padded(-set.reach[i]).contains(set.position(i)))
      found.push_back(static_cast<std::uint32_t>(i));
  return found;
}

GridUpdate follow_grid(PointSet& set, std::span<const std::uint32_t> touched, const SculptGrid& grid, double seconds,
                       const RunControl& run) {
  static_assert(kMostGrid == 6);
  switch (set.grid) {
    case 3: return follow_all<3>(set, touched, grid, seconds, run);
    case 4: return follow_all<4>(set, touched, grid, seconds, run);
    case 5: return follow_all<5>(set, touched, grid, seconds, run);
    default: return follow_all<6>(set, touched, grid, seconds, run);
  }
}

}  // namespace meniscus::pointset
