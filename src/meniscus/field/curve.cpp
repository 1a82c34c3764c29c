#include <meniscus/field/curve.h>

#include <meniscus/base/error.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace meniscus::field {

Curve::Curve(std::vector<double> times, std::vector<double> values, CurveInterpolation interpolation)
    : times_(std::move(times)), values_(std::move(values)), interpolation_(interpolation) {
  if (times_.empty()) throw InvalidInput("curve: no keys");
  if (times_.size() != values_.size())
    throw InvalidInput("curve: " + std::to_string(times_.size()) + " times but " + std::to_string(values_.size()) +
                       " values");
  for (std::size_t i = 0; i < times_.size(); ++i) {
    if (!std::isfinite(times_[i]) || !std::isfinite(values_[i]))
      throw InvalidInput("curve: key " + std::to_string(i) + " is not finite");
    if (i > 0 && !(times_[i] > times_[i - 1]))
      throw InvalidInput("curve: the time of key " + std::to_string(i) + " does not rise");
  }
  if (interpolation_ == CurveInterpolation::Cubic) set_slopes();
}

void Curve::set_slopes() {
  const std::size_t n = times_.size();
  slopes_.assign(n, 0.0);
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double before = times_[i] - times_[i - 1], after = times_[i + 1] - times_[i];
    const double p = (values_[i] - values_[i - 1]) / before, q = (values_[i + 1] - values_[i]) / after;
    if (!(p * q > 0)) continue;  // an extreme key stays one
    // The weighted harmonic mean keeps the cubic between its keys.
    const double w1 = 2 * after + before, w2 = after + 2 * before;
    slopes_[i] = (w1 + w2) / (w1 / p + w2 / q);
  }
}

TimeFunction::Sample Curve::at(double t) const {
  if (std::isnan(t)) return {t, t};
  if (t < times_.front()) return {values_.front(), 0};
  const auto after = std::upper_bound(times_.begin(), times_.end(), t);
  if (after == times_.end()) return {values_.back(), 0};
  const auto i = static_cast<std::size_t>(after - times_.begin()) - 1;
  if (interpolation_ == CurveInterpolation::Step) return {values_[i], 0};

  const double span = times_[i + 1] - times_[i], s = (t - times_[i]) / span;
  const double a = values_[i], rise = values_[i + 1] - a;
  if (interpolation_ == CurveInterpolation::Linear) return {a + s * rise, rise / span};

  // Hermite's cubic in s from a, with slopes per span m and n.
  const double m = slopes_[i] * span, n = slopes_[i + 1] * span;
  const double c2 = 3 * rise - 2 * m - n, c3 = m + n - 2 * rise;
  return {a + s * (m + s * (c2 + s * c3)), (m + s * (2 * c2 + s * 3 * c3)) / span};
}

}  // namespace meniscus::field
