#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>
#include <meniscus/sample/density.h>

#include <algorithm>
#include <cmath>

namespace meniscus::sample {

void check(const Density& d) {
  if (!(d.curvature >= 0) || !std::isfinite(d.curvature)) throw InvalidInput("curvature density must be a number >= 0");
  if (!(d.finest > 0 && d.finest <= 1)) throw InvalidInput("the smallest relative spacing must lie in (0, 1]");
  if (!d.focus) return;
  if (!d.focus->point.allFinite() || !(d.focus->radius > 0))
    throw InvalidInput("a focus needs a finite point and a radius > 0");
  if (!(d.focus->factor > 0 && d.focus->factor <= 1)) throw InvalidInput("the factor of a focus must lie in (0, 1]");
}

Curvature curvature(const Vec3& g, const Mat3& h) {
  const double slope = g.norm();
  if (!(slope > 0)) return {};
  const Vec3 n = g / slope;
  Mat3 adjugate;
  adjugate << h(1, 1) * h(2, 2) - h(1, 2) * h(1, 2), h(0, 2) * h(1, 2) - h(0, 1) * h(2, 2),
      h(0, 1) * h(1, 2) - h(0, 2) * h(1, 1), 0, h(0, 0) * h(2, 2) - h(0, 2) * h(0, 2), h(0, 1) * h(0, 2) - h(0, 0) * h(1, 2),
      0, 0, h(0, 0) * h(1, 1) - h(0, 1) * h(0, 1);
  adjugate(1, 0) = adjugate(0, 1);
  adjugate(2, 0) = adjugate(0, 2);
  adjugate(2, 1) = adjugate(1, 2);
  return {0.5 * (h.trace() - n.dot(h * n)) / slope, n.dot(adjugate * n) / (slope * slope)};
}

std::vector<Curvature> curvatures(const field::Field& surface, const SurfacePoints& points, const RunControl& run) {
  field::JetBatch jets(points.size(), field::Order::Hessian);
  field::evaluate(surface, points.positions(), jets.view(), run);
  std::vector<Curvature> out(points.size());
  parallel_for(points.size(), 1024, run, [&](std::size_t i) { out[i] = curvature(jets.gradient(i), jets.hessian(i)); });
  return out;
}

std::vector<double> wanted_spacing(const field::Field& surface, const Density& density, double spacing,
                                   const SurfacePoints& points, const RunControl& run) {
  std::vector<double> relative(points.size(), 1.0);
  if (density.curvature > 0) {
    const std::vector<Curvature> k = curvatures(surface, points, run);
    for (std::size_t i = 0; i < k.size(); ++i) {
      const double sum2 = std::max(0.0, 4 * k[i].mean * k[i].mean - 2 * k[i].gauss);  // κ₁² + κ₂²
      relative[i] /= std::sqrt(1 + density.curvature * density.curvature * spacing * spacing * sum2);
    }
  }
  if (density.focus)
    for (std::size_t i = 0; i < relative.size(); ++i) {
      const double r = (points.position(i) - density.focus->point).norm() / density.focus->radius;
      relative[i] *= 1 - (1 - density.focus->factor) / (1 + r * r);
    }
  if (density.factor) {
    field::JetBatch f(points.size(), field::Order::Value);
    field::evaluate(*density.factor, points.positions(), f.view(), run);
    for (std::size_t i = 0; i < relative.size(); ++i) relative[i] *= f.value(i);
  }
  for (double& r : relative) r = spacing * (r < 1 ? std::max(r, density.finest) : (r >= 1 ? 1.0 : density.finest));
  return relative;
}

}  // namespace meniscus::sample
