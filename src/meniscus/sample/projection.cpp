#include <meniscus/base/parallel.h>
#include <meniscus/sample/projection.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace meniscus::sample {
namespace {

constexpr double kProgress = 0.7;  // |F| must fall to this share in a step, or the next one is halved

Vec3 clamped(const Box& box, const Vec3& p) { return p.cwiseMax(box.min).cwiseMin(box.max); }

/// Newton on one block; points that have arrived or failed drop out of the batch.
void project_block(const field::Field& surface, const Box& box, const ProjectionOptions& options, SurfacePoints& points,
                   std::size_t begin, std::size_t end, std::uint8_t* arrived) {
  std::vector<std::size_t> active(end - begin);
  for (std::size_t k = 0; k < active.size(); ++k) active[k] = begin + k;
  std::vector<Vec3> start(active.size());
  for (const std::size_t i : active) {
    points.set_position(i, clamped(box, points.position(i)));
    start[i - begin] = points.position(i);
  }
  // Across a crease of F plain Newton steps can jump back and forth for ever: a point that came no nearer steps shorter.
  std::vector<double> damping(active.size(), 1.0), last(active.size(), std::numeric_limits<double>::infinity());
  field::PositionBatch batch(active.size());
  field::JetBatch jets(active.size(), field::Order::Gradient);
  for (int iteration = 0; iteration <= options.iterations && !active.empty(); ++iteration) {
    for (std::size_t k = 0; k < active.size(); ++k) batch.set(k, points.position(active[k]));
    const field::JetView view = jets.view();
    surface.evaluate(batch.view().part(0, active.size()), view.part(0, active.size()));
    std::size_t kept = 0;
    for (std::size_t k = 0; k < active.size(); ++k) {
      const std::size_t i = active[k];
      const Vec3 p = points.position(i), g = view.gradient(k);
      const double f = view.value(k), slope = g.norm();
      if (!std::isfinite(f) || !(slope > 0) || !std::isfinite(slope)) continue;
      points.set_normal(i, g / slope);
      if (std::abs(f) <= options.tolerance * slope) {
        arrived[i] = 1;
        continue;
      }
      if (std::abs(f) > kProgress * last[i - begin]) damping[i - begin] *= 0.5;
      last[i - begin] = std::abs(f);
      const Vec3 next = clamped(box, p + damping[i - begin] * newton_step(box, p, f, g));
      if (!next.allFinite() || (next - start[i - begin]).norm() > options.max_distance) continue;
      points.set_position(i, next);
      active[kept++] = i;
    }
    active.resize(kept);
  }
}

}  // namespace

Vec3 newton_step(const Box& box, const Vec3& p, double f, const Vec3& gradient) {
  Vec3 g = gradient;
  // On a face only the part of the gradient within the face can bring the point to the surface.
  for (int a = 0; a < 3; ++a)
    if ((p[a] <= box.min[a] && f * g[a] > 0) || (p[a] >= box.max[a] && f * g[a] < 0)) g[a] = 0;
  const double slope2 = g.squaredNorm();
  return slope2 > 0 ? Vec3(-f / slope2 * g) : Vec3(Vec3::Zero());
}

std::vector<std::uint8_t> project(const field::Field& surface, const Box& box, const ProjectionOptions& options,
                                  SurfacePoints& points, const RunControl& run) {
  std::vector<std::uint8_t> arrived(points.size(), 0);
  parallel_blocks(points.size(), field::kBlock, run, [&](std::size_t begin, std::size_t end) {
    project_block(surface, box, options, points, begin, end, arrived.data());
  });
  return arrived;
}

}  // namespace meniscus::sample
