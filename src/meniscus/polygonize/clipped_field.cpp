#include <meniscus/polygonize/clipped_field.h>

#include <algorithm>
#include <limits>

namespace meniscus::polygonize {

namespace {

double past(double x, double low, double high) { return std::max(low - x, x - high); }

}  // namespace

void ClippedField::evaluate(const field::Positions& x, const field::JetView& out) const {
  field_.evaluate(x, out);
  if (field::has_gradient(out.order)) clip_gradients(x, out);
  const Vec3 low = box_.min;
  const Vec3 high = box_.max;
  for (std::size_t i = 0; i < x.size; ++i) {
    const double b =
        std::max({past(x.x[i], low.x(), high.x()), past(x.y[i], low.y(), high.y()), past(x.z[i], low.z(), high.z())});
    out.rows[i] = b > out.rows[i] ? b : out.rows[i];  // NaN stays: whoever asks counts it
  }
}

/// Where the box decides, the gradient is the normal of its nearest face plane. Comes before the values are clipped.
void ClippedField::clip_gradients(const field::Positions& x, const field::JetView& out) const {
  for (std::size_t i = 0; i < x.size; ++i) {
    const Vec3 p = x[i];
    if (!(past_box(p) > out.rows[i])) continue;
    const Vec3 distance = (box_.min - p).cwiseMax(p - box_.max);
    Eigen::Index axis = 0;
    distance.maxCoeff(&axis);
    for (std::size_t a = 0; a < 3; ++a) out.row(field::kFx + a)[i] = 0;
    out.row(field::kFx + static_cast<std::size_t>(axis))[i] = p[axis] - box_.max[axis] == distance[axis] ? 1 : -1;
  }
}

field::Interval ClippedField::range(const Box& box) const {
  double low = -std::numeric_limits<double>::infinity();
  double high = low;
  for (int a = 0; a < 3; ++a) {
    low = std::max({low, box_.min[a] - box.max[a], box.min[a] - box_.max[a]});
    high = std::max({high, box_.min[a] - box.min[a], box.max[a] - box_.max[a]});
  }
  return field::max(field_.range(box), field::Interval(low, high));
}

}  // namespace meniscus::polygonize
