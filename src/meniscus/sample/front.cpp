#include <meniscus/base/random.h>
#include <meniscus/sample/front.h>
#include <meniscus/sample/point_hash.h>
#include <meniscus/sample/projection.h>
#include <meniscus/sample/surface_cell.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace meniscus::sample {
namespace {

constexpr double kSameSide = -0.3;    // a child's normal may turn this far from its parent's (cosine)
constexpr double kEarlyReject = 0.6;  // of the acceptance distance, before the candidate is projected

class Growth {
 public:
  Growth(const field::Field& surface, const Box& box, const FrontOptions& options, const RunControl& run)
      : surface_(surface),
        box_(box),
        options_(options),
        run_(run),
        hash_(box.center(), 2 * options.acceptance * options.spacing) {}

  Front grown(const SurfacePoints& seeds) {
    if (options_.occupied) occupy(*options_.occupied);
    const std::vector<double> spacing = wanted_spacing(surface_, options_.density, options_.spacing, seeds, run_);
    for (std::size_t s = 0; s < seeds.size() && !front_.capped; ++s) {
      if (crowded(seeds.position(s), seeds.normal(s), spacing[s], 1.0)) continue;
      ++front_.seeds;
      add(seeds.position(s), seeds.normal(s), direction_at(seeds, s), spacing[s]);
      while (ring_begin_ < front_.points.size() && !front_.capped) grow_ring();
    }
    return std::move(front_);
  }

 private:
  struct Candidates {
    SurfacePoints points;
    std::vector<std::uint32_t> parent;
  };

  /// Points that stand already take room and offer nothing.
  void occupy(const SurfacePoints& points) {
    const std::vector<double> spacing = wanted_spacing(surface_, options_.density, options_.spacing, points, run_);
    for (std::size_t i = 0; i < points.size(); ++i) add(points.position(i), points.normal(i), Vec3::Zero(), spacing[i]);
    ring_begin_ = front_.points.size();
  }

  /// Where the first tile of a component points: at random, by the control's seed.
  Vec3 direction_at(const SurfacePoints& seeds, std::size_t s) const {
    const double angle = 2 * std::numbers::pi * random_uniform(run_.seed(), s, 0)[0];
    Vec3 u, v;
    tangent_frame(seeds.normal(s), u, v);
    return std::cos(angle) * u + std::sin(angle) * v;
  }

  void add(const Vec3& p, const Vec3& n, const Vec3& direction, double spacing) {
    if (front_.points.size() >= options_.max_count) {
      front_.capped = true;
      return;
    }
    front_.points.push_back(p, n);
    front_.spacing.push_back(spacing);
    direction_.push_back(direction);
    hash_.insert(p);
  }

  /// Is some point of the same sheet nearer than `share` of the spacing?
  bool crowded(const Vec3& p, const Vec3& n, double spacing, double share) const {
    const SurfacePoints& points = front_.points;
    return hash_.any_near(p, share * options_.spacing, [&](std::uint32_t j) {
      const double limit = share * 0.5 * (spacing + front_.spacing[j]);
      return (points.position(j) - p).squaredNorm() < limit * limit &&
             same_sheet(n.x(), n.y(), n.z(), points.nx[j], points.ny[j], points.nz[j]) > 0;
    });
  }

  /// The six neighbours that point i wants, less those that are there already.
  void offer(std::uint32_t i, Candidates& out) const {
    const Vec3 p = front_.points.position(i), n = front_.points.normal(i);
    Vec3 u = direction_[i] - direction_[i].dot(n) * n;
    if (!(u.norm() > 1e-9 * direction_[i].norm())) u = n.unitOrthogonal();
    u.normalize();
    const Vec3 v = n.cross(u);
    for (int k = 0; k < 6; ++k) {
      const double angle = k * std::numbers::pi / 3;
      const Vec3 q = p + front_.spacing[i] * (std::cos(angle) * u + std::sin(angle) * v);
      if (crowded(q, n, front_.spacing[i], kEarlyReject * options_.acceptance)) continue;
      out.points.push_back(q, n);
      out.parent.push_back(i);
    }
  }

  void grow_ring() {
    Candidates c;
    const std::size_t end = front_.points.size();
    for (; ring_begin_ < end; ++ring_begin_) offer(static_cast<std::uint32_t>(ring_begin_), c);
    if (c.points.empty()) return;
    const std::vector<std::uint8_t> arrived = project(surface_, box_,
                                                      {.tolerance = std::max(options_.tolerance, 1e-3 * options_.spacing),
                                                       .max_distance = options_.spacing,
                                                       .iterations = 8},
                                                      c.points, run_);
    const std::vector<double> spacing = wanted_spacing(surface_, options_.density, options_.spacing, c.points, run_);
    for (std::size_t k = 0; k < c.parent.size() && !front_.capped; ++k) {
      const std::uint32_t i = c.parent[k];
      const Vec3 p = c.points.position(k), n = c.points.normal(k);
      if (!arrived[k] || n.dot(front_.points.normal(i)) < kSameSide || crowded(p, n, spacing[k], options_.acceptance))
        continue;
      add(p, n, p - front_.points.position(i), spacing[k]);
    }
  }

  const field::Field& surface_;
  const Box& box_;
  const FrontOptions& options_;
  const RunControl& run_;
  PointHash hash_;
  Front front_;
  std::vector<Vec3> direction_;
  std::size_t ring_begin_ = 0;
};

}  // namespace

Front grow_front(const field::Field& surface, const Box& box, const SurfacePoints& seeds, const FrontOptions& options,
                 const RunControl& run) {
  return Growth(surface, box, options, run).grown(seeds);
}

}  // namespace meniscus::sample
