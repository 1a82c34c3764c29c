#include <meniscus/polygonize/clipped_field.h>

namespace meniscus::polygonize {

void ClippedField::evaluate(const field::Positions& x, const field::JetView& out) const {
  field_.evaluate(x, out);
  const bool with_gradient = field::has_gradient(out.order);
  for (std::size_t i = 0; i < x.size; ++i) {
    double best = box_.min.x() - x.x[i];
    std::size_t axis = 0;
    double side = -1;
    const auto consider = [&](double b, std::size_t a, double s) {
      if (b > best) {
        best = b;
        axis = a;
        side = s;
      }
    };
    consider(x.x[i] - box_.max.x(), 0, 1);
    consider(box_.min.y() - x.y[i], 1, -1);
    consider(x.y[i] - box_.max.y(), 1, 1);
    consider(box_.min.z() - x.z[i], 2, -1);
    consider(x.z[i] - box_.max.z(), 2, 1);
    double& f = out.rows[i];
    if (!(best > f)) continue;  // NaN stays: whoever asks counts it
    f = best;
    if (!with_gradient) continue;
    for (std::size_t a = 0; a < 3; ++a) out.row(field::kFx + a)[i] = a == axis ? side : 0;
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
