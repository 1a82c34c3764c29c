#include <meniscus/base/parallel.h>
#include <meniscus/field/cpu.h>
#include <meniscus/sample/neighbour_grid.h>
#include <meniscus/sample/projection.h>
#include <meniscus/sample/relax.h>
#include <meniscus/sample/relax_kernel.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace meniscus::sample {
namespace {

/// Neighbour lists reach `skin` spacings farther than the kernel and are built anew when the points that may move are
/// displaced by `stale` spacings in the mean. What a few fast ones miss lies at the rim of the kernel, where the force
/// vanishes; in a patch a few fast ones are all there are.
struct Upkeep {
  double skin, stale;
};
constexpr Upkeep kEverywhere{0.15, 0.15}, kInPatches{0.25, 0.1};
constexpr double kBent = 0.7;          // cosine between normals of neighbours below which arcs replace chords
constexpr double kBentMomentum = 0.5;  // there a displacement soon points off the surface
constexpr double kMaxMove = 0.2;       // spacings per step
constexpr double kMaxForce = 0.1;      // the same, for the part that comes from the force alone

relax_kernel::PairKernel kernel_for(RelaxOptions::Kernel kernel) {
  using namespace relax_kernel;
  if (kernel == RelaxOptions::Kernel::Smooth) return field::has_avx2() ? smooth_avx2 : pair_force<Smooth>;
  return field::has_avx2() ? contact_avx2 : pair_force<Contact>;
}

Vec3 shortened(const Vec3& v, double longest) {
  const double length2 = v.squaredNorm();
  return length2 > longest * longest ? Vec3(longest / std::sqrt(length2) * v) : v;
}

/// The state of a run: current points, the next ones (written block by block), and the last displacements.
class Relaxation {
 public:
  Relaxation(const field::Field& surface, const Box& box, SurfacePoints& points, std::span<const double> spacing,
             const RelaxOptions& options, std::span<const std::uint8_t> movable)
      : surface_(surface),
        box_(box),
        now_(points),
        spacing_(spacing),
        options_(options),
        movable_(movable),
        contact_(options.kernel == RelaxOptions::Kernel::Contact && options.momentum == 0),
        upkeep_(movable.empty() ? kEverywhere : kInPatches),
        moving_(movable.empty() ? points.size() : static_cast<std::size_t>(std::count(movable.begin(), movable.end(), 1))),
        kernel_(kernel_for(options.kernel)),
        next_(points) {
    for (auto* a : {&vx_, &vy_, &vz_}) a->assign(points.size(), 0.0);
    awake_.assign(points.size(), 1);
    woken_ = awake_;
  }

  void run(const RunControl& control) {
    for (int s = 0; s < options_.steps; ++s) {
      if (moved_ > upkeep_.stale) rebuild(control);
      step(control);
      std::swap(now_, next_);
      std::swap(awake_, woken_);
      control.progress(static_cast<double>(s + 1) / options_.steps);
    }
  }

 private:
  void rebuild(const RunControl& control) {
    std::vector<double> reach(spacing_.begin(), spacing_.end());
    for (double& r : reach) r *= options_.reach + upkeep_.skin;
    neighbours_ = find_neighbours(now_.positions(), reach, control);
    // Only those of the same sheet repel.
    bent_.assign(now_.size(), 0);
    parallel_for(now_.size(), 1024, control, [&](std::size_t i) {
      std::uint32_t* list = neighbours_.index.data() + neighbours_.first[i];
      std::uint32_t kept = 0;
      for (std::uint32_t k = 0; k < neighbours_.count[i]; ++k) {
        const std::uint32_t j = list[k];
        if (!(same_sheet(now_, i, j) > 0)) continue;
        list[kept++] = j;
        bent_[i] |= now_.normal(i).dot(now_.normal(j)) < kBent;
      }
      neighbours_.count[i] = kept;
    });
    anchor_x_ = now_.x;
    anchor_y_ = now_.y;
    anchor_z_ = now_.z;
    moved_ = 0;
  }

  void step(const RunControl& control) {
    moved_ = parallel_reduce(
        now_.size(), field::kBlock, control, 0.0, [&](std::size_t begin, std::size_t end) { return step_block(begin, end); },
        [](double a, double b) { return a + b; });
    moved_ /= static_cast<double>(std::max<std::size_t>(moving_, 1));
  }

  /// Whether point i has to be looked at: it may move, and what it touches has moved since it was last at rest.
  bool stirred(std::size_t i) const {
    if (!movable_.empty() && !movable_[i]) return false;
    if (!contact_ || awake_[i]) return true;
    const auto near = neighbours_.of(i);
    return std::any_of(near.begin(), near.end(), [&](std::uint32_t j) { return awake_[j] != 0; });
  }

  void evaluate(std::size_t begin, std::size_t end, std::span<const std::uint32_t> taken, const field::JetView& jets) const {
    if (taken.size() == end - begin) return surface_.evaluate(now_.positions().part(begin, end - begin), jets);
    if (taken.empty()) return;
    std::array<double, 3 * field::kBlock> xyz;
    double *x = xyz.data(), *y = x + field::kBlock, *z = y + field::kBlock;
    for (std::size_t k = 0; k < taken.size(); ++k) {
      x[k] = now_.x[taken[k]];
      y[k] = now_.y[taken[k]];
      z[k] = now_.z[taken[k]];
    }
    surface_.evaluate({x, y, z, taken.size()}, jets);
  }

  /// Returns the sum of displacements since the lists were built, in spacings.
  double step_block(std::size_t begin, std::size_t end) {
    std::array<std::uint32_t, field::kBlock> taken;
    std::size_t count = 0;
    double moved = 0;
    for (std::size_t i = begin; i < end; ++i) {
      if (stirred(i)) {
        taken[count++] = static_cast<std::uint32_t>(i);
        continue;
      }
      const Vec3 p = now_.position(i);
      next_.set_position(i, p);
      next_.set_normal(i, now_.normal(i));
      woken_[i] = 0;
      moved += wear(i, p);
    }
    std::array<double, 4 * field::kBlock> rows;
    const field::JetView jets{rows.data(), field::kBlock, count, field::Order::Gradient};
    evaluate(begin, end, {taken.data(), count}, jets);
    const relax_kernel::PairInput pairs_in{now_.x.data(), now_.y.data(), now_.z.data(), spacing_.data(),
                                           0.5 * options_.reach};
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t i = taken[k];
      const Vec3 p = now_.position(i), g = jets.gradient(k);
      const double f = jets.value(k), slope = g.norm();
      woken_[i] = 1;
      if (!(slope > 0) || !std::isfinite(f) || !std::isfinite(slope)) {  // singular: leave it alone
        next_.set_position(i, p);
        next_.set_normal(i, now_.normal(i));
        continue;
      }
      const Vec3 n = (1 / slope) * g;
      const relax_kernel::PairForce pairs =
          bent_[i] ? bent_force(i, n)
                   : kernel_(pairs_in, static_cast<std::uint32_t>(i), neighbours_.of(i).data(), neighbours_.count[i]);
      woken_[i] = !contact_ || pairs.stiffness > 0;
      // Half the trace: the mean over the two tangent directions.
      Vec3 force = pairs.stiffness > 0 ? Vec3(2 / pairs.stiffness * Vec3(pairs.x, pairs.y, pairs.z)) : Vec3(Vec3::Zero());
      force = shortened(options_.step * (force - force.dot(n) * n), kMaxForce * spacing_[i]);
      Vec3 velocity(vx_[i], vy_[i], vz_[i]);
      velocity = (bent_[i] ? std::min(kBentMomentum, options_.momentum) : options_.momentum) * velocity + force;
      velocity = shortened(velocity - velocity.dot(n) * n, kMaxMove * spacing_[i]);
      const Vec3 home = shortened(newton_step(box_, p, f, g), kMaxMove * spacing_[i]);
      const Vec3 q = (p + velocity + home).cwiseMax(box_.min).cwiseMin(box_.max);
      const Vec3 made = q - p - home;  // what the box let through
      vx_[i] = made.x();
      vy_[i] = made.y();
      vz_[i] = made.z();
      next_.set_position(i, q);
      next_.set_normal(i, n);
      moved += wear(i, q);
    }
    return moved;
  }

  /// How far point i is from where the lists were built, in spacings. A quarter of the points speaks for all.
  double wear(std::size_t i, const Vec3& p) const {
    if (i % 4 != 0) return 0;
    return 4 * (p - Vec3(anchor_x_[i], anchor_y_[i], anchor_z_[i])).norm() / spacing_[i];
  }

  /// The same sum where the surface turns much within the reach: chords would point into the body there, so neighbours push
  /// along the start of the geodesic and by its length, as SurfaceCell unrolls them.
  relax_kernel::PairForce bent_force(std::size_t i, const Vec3& n) const {
    relax_kernel::PairForce sum{0, 0, 0, 0};
    for (const std::uint32_t j : neighbours_.of(i)) {
      const Vec3 d = now_.position(j) - now_.position(i), m = now_.normal(j);
      Vec3 away = d.dot(n) / 3 * (m - n) - d;
      away -= away.dot(n) * n;
      const double inverse = 2 / (options_.reach * (spacing_[i] + spacing_[j])), flat = away.norm();
      const double x = 1 - d.norm() * arc_over_chord(d, n, m) * inverse;
      if (!(x > 0) || !(flat > 0)) continue;
      const bool smooth = options_.kernel == RelaxOptions::Kernel::Smooth;
      const double weight = same_sheet(n.x(), n.y(), n.z(), m.x(), m.y(), m.z());
      const double push = weight * (smooth ? 4 * x * x * x : 2 * x) * inverse / flat;
      sum.x += push * away.x();
      sum.y += push * away.y();
      sum.z += push * away.z();
      sum.stiffness += weight * (smooth ? 12 * x * x : 2) * inverse * inverse;
    }
    return sum;
  }

  const field::Field& surface_;
  const Box& box_;
  SurfacePoints& now_;
  std::span<const double> spacing_;
  const RelaxOptions& options_;
  std::span<const std::uint8_t> movable_;
  bool contact_;  // nothing acts on a point that touches no other: it rests until a neighbour has moved
  Upkeep upkeep_;
  std::size_t moving_;  // points that may move
  relax_kernel::PairKernel kernel_;
  SurfacePoints next_;
  std::vector<double> vx_, vy_, vz_;
  std::vector<std::uint8_t> awake_, woken_;  // in the last step, and in this one
  std::vector<double> anchor_x_, anchor_y_, anchor_z_;
  Neighbours neighbours_;
  std::vector<std::uint8_t> bent_;  // some neighbour's normal differs much
  double moved_ = 1e300;
};

}  // namespace

void relax(const field::Field& surface, const Box& box, SurfacePoints& points, std::span<const double> spacing,
           const RelaxOptions& options, const RunControl& run, std::span<const std::uint8_t> movable) {
  if (points.empty()) return;
  Relaxation(surface, box, points, spacing, options, movable).run(run);
}

}  // namespace meniscus::sample
