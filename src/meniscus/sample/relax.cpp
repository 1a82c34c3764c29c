#include <meniscus/base/parallel.h>
#include <meniscus/sample/neighbour_grid.h>
#include <meniscus/sample/projection.h>
#include <meniscus/sample/relax.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace meniscus::sample {
namespace {

constexpr double kSkin = 0.25;    // neighbour lists reach this many spacings farther than the kernel
constexpr double kStale = 0.1;    // mean displacement, in spacings, at which lists are built anew: what a few fast particles
                                  // miss lies at the rim of the kernel, where the force vanishes
constexpr double kMaxMove = 0.2;  // spacings per step
constexpr double kMaxForce = 0.1;  // the same, for the part that comes from the force alone

/// Minus the first derivative and the second derivative of w at x = 1 − r/h.
struct Smooth {
  static double push(double x) { return 4 * x * x * x; }
  static double stiffness(double x) { return 12 * x * x; }
};
struct Contact {
  static double push(double x) { return 2 * x; }
  static double stiffness(double) { return 2; }
};

/// Force and stiffness that its neighbours exert on particle i.
template <class Kernel>
Vec3 newton_direction(const SurfacePoints& p, std::size_t i, std::span<const std::uint32_t> neighbours,
                      const double* spacing, double reach) {
  double fx = 0, fy = 0, fz = 0, stiffness = 0;
  for (const std::uint32_t j : neighbours) {
    const double dx = p.x[i] - p.x[j], dy = p.y[i] - p.y[j], dz = p.z[i] - p.z[j];
    const double r2 = dx * dx + dy * dy + dz * dz, h = 0.5 * reach * (spacing[i] + spacing[j]);
    if (r2 >= h * h || !(r2 > 0)) continue;
    const double weight = same_sheet(p, i, j), r = std::sqrt(r2), x = 1 - r / h;
    const double push = weight * Kernel::push(x) / (h * r);
    fx += push * dx;
    fy += push * dy;
    fz += push * dz;
    stiffness += weight * Kernel::stiffness(x) / (h * h);
  }
  // Half the trace: the mean over the two tangent directions.
  return stiffness > 0 ? Vec3(2 / stiffness * Vec3(fx, fy, fz)) : Vec3(Vec3::Zero());
}

Vec3 shortened(const Vec3& v, double longest) {
  const double length = v.norm();
  return length > longest ? Vec3(longest / length * v) : v;
}

/// The state of a run: current points, the next ones (written block by block), and the last displacements.
class Relaxation {
 public:
  Relaxation(const field::Field& surface, const Box& box, SurfacePoints& points, std::span<const double> spacing,
             const RelaxOptions& options)
      : surface_(surface), box_(box), now_(points), spacing_(spacing), options_(options), next_(points) {
    for (auto* a : {&vx_, &vy_, &vz_}) a->assign(points.size(), 0.0);
  }

  void run(const RunControl& control) {
    for (int s = 0; s < options_.steps; ++s) {
      if (moved_ > kStale) rebuild(control);
      if (options_.kernel == RelaxOptions::Kernel::Smooth)
        step<Smooth>(control);
      else
        step<Contact>(control);
      std::swap(now_, next_);
      control.progress(static_cast<double>(s + 1) / options_.steps);
    }
  }

 private:
  void rebuild(const RunControl& control) {
    std::vector<double> reach(spacing_.begin(), spacing_.end());
    for (double& r : reach) r *= options_.reach + kSkin;
    neighbours_ = find_neighbours(now_.positions(), reach, control);
    anchor_x_ = now_.x;
    anchor_y_ = now_.y;
    anchor_z_ = now_.z;
    moved_ = 0;
  }

  template <class Kernel>
  void step(const RunControl& control) {
    moved_ = parallel_reduce(
        now_.size(), field::kBlock, control, 0.0,
        [&](std::size_t begin, std::size_t end) { return step_block<Kernel>(begin, end); },
        [](double a, double b) { return a + b; });
    moved_ /= static_cast<double>(now_.size());
  }

  /// Returns the sum of displacements since the lists were built, in spacings.
  template <class Kernel>
  double step_block(std::size_t begin, std::size_t end) {
    std::array<double, 4 * field::kBlock> rows;
    const field::JetView jets{rows.data(), field::kBlock, end - begin, field::Order::Gradient};
    surface_.evaluate(now_.positions().part(begin, end - begin), jets);
    double moved = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 p = now_.position(i), g = jets.gradient(i - begin);
      const double f = jets.value(i - begin), slope = g.norm();
      if (!(slope > 0) || !std::isfinite(f) || !std::isfinite(slope)) {  // singular: leave it alone
        next_.set_position(i, p);
        next_.set_normal(i, now_.normal(i));
        continue;
      }
      const Vec3 n = g / slope;
      Vec3 force = newton_direction<Kernel>(now_, i, neighbours_.of(i), spacing_.data(), options_.reach);
      force = shortened(options_.step * (force - force.dot(n) * n), kMaxForce * spacing_[i]);
      Vec3 velocity(vx_[i], vy_[i], vz_[i]);
      velocity = options_.momentum * velocity + force;
      velocity = shortened(velocity - velocity.dot(n) * n, kMaxMove * spacing_[i]);
      const Vec3 home = shortened(newton_step(box_, p, f, g), kMaxMove * spacing_[i]);
      const Vec3 q = (p + velocity + home).cwiseMax(box_.min).cwiseMin(box_.max);
      const Vec3 made = q - p - home;  // what the box let through
      vx_[i] = made.x();
      vy_[i] = made.y();
      vz_[i] = made.z();
      next_.set_position(i, q);
      next_.set_normal(i, n);
      moved += (q - Vec3(anchor_x_[i], anchor_y_[i], anchor_z_[i])).norm() / spacing_[i];
    }
    return moved;
  }

  const field::Field& surface_;
  const Box& box_;
  SurfacePoints& now_;
  std::span<const double> spacing_;
  const RelaxOptions& options_;
  SurfacePoints next_;
  std::vector<double> vx_, vy_, vz_;
  std::vector<double> anchor_x_, anchor_y_, anchor_z_;
  Neighbours neighbours_;
  double moved_ = 1e300;
};

}  // namespace

void relax(const field::Field& surface, const Box& box, SurfacePoints& points, std::span<const double> spacing,
           const RelaxOptions& options, const RunControl& run) {
  if (points.empty()) return;
  Relaxation(surface, box, points, spacing, options).run(run);
}

}  // namespace meniscus::sample
