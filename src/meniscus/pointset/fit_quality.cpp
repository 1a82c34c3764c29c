#include <meniscus/pointset/fit_quality.h>
#include <meniscus/pointset/local_fit.h>
#include <meniscus/pointset/point_set_field.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace meniscus::pointset {

FitQuality fit_quality(const PointSet& set, const RunControl& run) {
  FitQuality q;
  if (set.empty()) return q;
  const PointSetField field(set);
  const auto jets = field::evaluate(field, positions(set), field::Order::Gradient, run);
  for (std::size_t i = 0; i < set.size(); ++i) {
    const double value = std::abs(jets.value(i));
    const Vec3 g = jets.gradient(i), n = set.normal(i);
    q.mean_value += value;
    q.max_value = std::max(q.max_value, value);
    q.mean_normal_error += std::atan2(g.cross(n).norm(), g.dot(n));
  }
  q.mean_value /= static_cast<double>(set.size());
  q.mean_normal_error *= 180 / std::numbers::pi / static_cast<double>(set.size());
  return q;
}

}  // namespace meniscus::pointset
