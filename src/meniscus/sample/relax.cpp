#include <meniscus/base/parallel.h>
#include <meniscus/field/cpu.h>
#include <meniscus/sample/projection.h>
#include <meniscus/sample/relax.h>
#include <meniscus/sample/relax_kernel.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace meniscus::sample {
namespace {

constexpr double kSkin = 0.05;         // neighbour lists reach this many spacings farther than the kernel,
constexpr double kContactSkin = 0.15;  // than that of Contact,
constexpr double kPatchSkin = 0.25;    // and where few points may move: what a few fast ones miss lies at the rim of the
constexpr double kPatchWorn = 0.1;     // kernel, where the force vanishes, but in a patch a few fast ones are all there are
constexpr double kBent = 0.7;          // cosine between normals of neighbours below which arcs replace chords
constexpr double kBentMomentum = 0.5;  // there a displacement soon points off the surface
constexpr double kMaxMove = 0.2;       // spacings per step
constexpr std::size_t kGroup = 8;      // neighbours that the kernels take at once
constexpr float kFar = 1e15F;          // largest spacings
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
             const RelaxOptions& options, std::span<const std::uint8_t> movable, Surroundings& near)
      : surface_(surface),
        box_(box),
        now_(points),
        spacing_(spacing),
        options_(options),
        movable_(movable),
        surroundings_(near),
        contact_(options.kernel == RelaxOptions::Kernel::Contact && options.momentum == 0),
        kernel_(kernel_for(options.kernel)),
        next_(points) {
    for (auto* a : {&vx_, &vy_, &vz_}) a->assign(points.size(), 0.0);
    awake_.assign(points.size() + 1, 1);
    awake_.back() = 0;
    woken_ = awake_;
    unit_ = *std::max_element(spacing.begin(), spacing.end());
    inverse_unit_ = 1 / unit_;
    seen_.resize(points.size() + 1);
    for (std::size_t i = 0; i < points.size(); ++i) seen_[i] = seen(i, points.position(i));
    seen_.back() = {kFar, kFar, kFar, 0};
    seen_next_ = seen_;
  }

  void run(const RunControl& control) {
    for (int s = 0; s < options_.steps; ++s) {
      if (surroundings_.refresh(now_, spacing_, control) || s == 0) list_neighbours(control);
      step(control);
      std::swap(now_, next_);
      std::swap(seen_, seen_next_);
      std::swap(awake_, woken_);
      control.progress(static_cast<double>(s + 1) / options_.steps);
    }
  }

 private:
  /// Takes those that can repel from the surroundings.
  void list_neighbours(const RunControl& control) {
    const Neighbours& found = surroundings_.lists();
    const double reach = options_.reach + (!movable_.empty() ? kPatchSkin : contact_ ? kContactSkin : kSkin);
    const auto repels = [&](std::size_t i, std::size_t j) {
      const double longest = reach * std::max(spacing_[i], spacing_[j]);
      return (now_.position(i) - now_.position(j)).squaredNorm() < longest * longest && same_sheet(now_, i, j) > 0;
    };
    first_.assign(now_.size() + 1, 0);
    for (std::size_t i = 0; i < now_.size(); ++i) first_[i + 1] = first_[i] + found.count[i] + kGroup - 1;
    near_.resize(first_.back());
    count_.resize(now_.size());
    bent_.assign(now_.size(), 0);
    parallel_for(now_.size(), 1024, control, [&](std::size_t i) {
      std::uint32_t* const list = near_.data() + first_[i];
      std::uint32_t count = 0;
      for (const std::uint32_t j : found.of(i)) {
        if (!repels(i, j)) continue;
        list[count++] = j;
        bent_[i] |= now_.normal(i).dot(now_.normal(j)) < kBent;
      }
      while (count % kGroup != 0) list[count++] = static_cast<std::uint32_t>(now_.size());
      count_[i] = count;
    });
  }

  void step(const RunControl& control) {
    parallel_blocks(now_.size(), field::kBlock, control,
                    [&](std::size_t begin, std::size_t end) { step_block(begin, end); });
  }

  std::span<const std::uint32_t> near_of(std::size_t i) const { return {near_.data() + first_[i], count_[i]}; }

  /// Point i at p as its neighbours see it.
  relax_kernel::Neighbour seen(std::size_t i, const Vec3& p) const {
    const Vec3 q = inverse_unit_ * (p - middle_);
    return {static_cast<float>(q.x()), static_cast<float>(q.y()), static_cast<float>(q.z()),
            static_cast<float>(inverse_unit_ * spacing_[i])};
  }

  void put(std::size_t i, const Vec3& p, const Vec3& n) {
    next_.set_position(i, p);
    next_.set_normal(i, n);
    seen_next_[i] = seen(i, p);
  }

  /// Whether point i has to be looked at: it may move, and what it touches has moved since it was last at rest.
  bool stirred(std::size_t i) const {
    if (!movable_.empty() && !movable_[i]) return false;
    if (!contact_ || awake_[i]) return true;
    const auto near = near_of(i);
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

  void step_block(std::size_t begin, std::size_t end) {
    std::array<std::uint32_t, field::kBlock> taken;
    std::size_t count = 0;
    for (std::size_t i = begin; i < end; ++i) {
      if (stirred(i)) {
        taken[count++] = static_cast<std::uint32_t>(i);
        continue;
      }
      const Vec3 p = now_.position(i);
      put(i, p, now_.normal(i));
      woken_[i] = 0;
    }
    std::array<double, 4 * field::kBlock> rows;
    const field::JetView jets{rows.data(), field::kBlock, count, field::Order::Gradient};
    evaluate(begin, end, {taken.data(), count}, jets);
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t i = taken[k];
      const Vec3 p = now_.position(i), g = jets.gradient(k);
      const double f = jets.value(k), slope = g.norm();
      woken_[i] = 1;
      if (!(slope > 0) || !std::isfinite(f) || !std::isfinite(slope)) {  // singular: leave it alone
        put(i, p, now_.normal(i));
        continue;
      }
      const Vec3 n = (1 / slope) * g;
      const Push pairs = bent_[i] ? bent_push(i, n) : push(i);
      woken_[i] = !contact_ || pairs.stiffness > 0;
      // Half the trace: the mean over the two tangent directions.
      Vec3 force = pairs.stiffness > 0 ? Vec3(2 / pairs.stiffness * pairs.force) : Vec3(Vec3::Zero());
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
      put(i, q, n);
    }
  }

  struct Push {
    Vec3 force;
    double stiffness;
  };

  Push push(std::size_t i) const {
    const auto near = near_of(i);
    const relax_kernel::PairForce f = kernel_(seen_.data(), static_cast<float>(0.5 * options_.reach),
                                              static_cast<std::uint32_t>(i), near.data(), near.size());
    return {unit_ * Vec3(f.x, f.y, f.z), f.stiffness};
  }

  /// The same sum where the surface turns much within the reach: chords would point into the body there, so neighbours push
  /// along the start of the geodesic and by its length, as SurfaceCell unrolls them.
  Push bent_push(std::size_t i, const Vec3& n) const {
    Push sum{Vec3::Zero(), 0};
    for (const std::uint32_t j : near_of(i)) {
      if (j == now_.size()) break;
      const Vec3 d = now_.position(j) - now_.position(i), m = now_.normal(j);
      Vec3 away = d.dot(n) / 3 * (m - n) - d;
      away -= away.dot(n) * n;
      const double inverse = 2 / (options_.reach * (spacing_[i] + spacing_[j])), flat = away.norm();
      const double x = 1 - d.norm() * arc_over_chord(d, n, m) * inverse;
      if (!(x > 0) || !(flat > 0)) continue;
      const bool smooth = options_.kernel == RelaxOptions::Kernel::Smooth;
      const double weight = same_sheet(n.x(), n.y(), n.z(), m.x(), m.y(), m.z());
      sum.force += weight * (smooth ? 4 * x * x * x : 2 * x) * inverse / flat * away;
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
  Surroundings& surroundings_;
  bool contact_;  // nothing acts on a point that touches no other: it rests until a neighbour has moved
  relax_kernel::PairKernel kernel_;
  SurfacePoints next_;
  std::vector<double> vx_, vy_, vz_;
  std::vector<std::uint8_t> awake_, woken_;  // in the last step, and in this one
  std::vector<std::size_t> first_;
  std::vector<std::uint32_t> count_, near_;  // groups of neighbours; free places name the particle behind the last, far away
  double unit_, inverse_unit_;               // of what the kernels see
  Vec3 middle_ = box_.center();              // from the box, not from the points: what is far away changes nothing
  std::vector<relax_kernel::Neighbour> seen_, seen_next_;
  std::vector<std::uint8_t> bent_;  // some neighbour's normal differs much
};

}  // namespace

void relax(const field::Field& surface, const Box& box, SurfacePoints& points, std::span<const double> spacing,
           const RelaxOptions& options, const RunControl& run, std::span<const std::uint8_t> movable, Surroundings* near) {
  if (points.empty()) return;
  const auto moving = static_cast<double>(std::count(movable.begin(), movable.end(), 1));
  Surroundings patch(options.reach + kPatchSkin, kPatchWorn * moving / static_cast<double>(points.size())), all;
  Surroundings& own = movable.empty() ? all : patch;
  Relaxation(surface, box, points, spacing, options, movable, near ? *near : own).run(run);
}

}  // namespace meniscus::sample
