#include <meniscus/polygonize/clipped_field.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace meniscus::polygonize {

namespace {

double past(double x, double low, double high) { return std::max(low - x, x - high); }

}  // namespace

ClippedField::ClippedField(const field::Field& field, const Box& box) : field_(field), box_(box) {
  if (!box.finite() || box.empty()) return;
  const double depth = -field.range(box).lo;
  const double half_width = 0.5 * box.size().minCoeff();
  if (depth > 0 && half_width > 0 && std::isfinite(depth / half_width)) slope_ = depth / half_width;
}

void ClippedField::evaluate(const field::Positions& x, const field::JetView& out) const {
  field_.evaluate(x, out);
  if (field::has_gradient(out.order)) clip_gradients(x, out);
  const Vec3 low = box_.min;
  const Vec3 high = box_.max;
  for (std::size_t i = 0; i < x.size; ++i) {
    const double b = slope_ * std::max({past(x.x[i], low.x(), high.x()), past(x.y[i], low.y(), high.y()),
                                        past(x.z[i], low.z(), high.z())});
    out.rows[i] = b > out.rows[i] ? b : out.rows[i];  // NaN stays: whoever asks counts it
  }
}

/// Where the box decides, the gradient is the normal of its nearest face plane. Comes before the values are clipped.
void ClippedField::clip_gradients(const field::Positions& x, const field::JetView& out) const {
  for (std::size_t i = 0; i < x.size; ++i) {
    const Vec3 p = x[i];
    if (!(slope_ * past_box(p) > out.rows[i])) continue;
    const Vec3 distance = (box_.min - p).cwiseMax(p - box_.max);
    Eigen::Index axis = 0;
    distance.maxCoeff(&axis);
    for (std::size_t a = 0; a < 3; ++a) out.row(field::kFx + a)[i] = 0;
    out.row(field::kFx + static_cast<std::size_t>(axis))[i] = p[axis] - box_.max[axis] == distance[axis] ? slope_ : -slope_;
  }
}

field::Interval ClippedField::range(const Box& box) const {
  double low = -std::numeric_limits<double>::infinity();
  double high = low;
  for (int a = 0; a < 3; ++a) {
    low = std::max({low, box_.min[a] - box.max[a], box.min[a] - box_.max[a]});
    high = std::max({high, box_.min[a] - box.min[a], box.max[a] - box_.max[a]});
  }
  return field::max(field_.range(box), field::Interval(slope_ * low, slope_ * high));
}

}  // namespace meniscus::polygonize
