#include <meniscus/field/interval.h>

namespace meniscus::field {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPi = 3.14159265358979323846;

/// 0 · ∞ counts as 0: the ends are limits, and the product's bound is reached elsewhere.
double times(double a, double b) { return a == 0 || b == 0 ? 0 : a * b; }

}  // namespace

Interval operator*(Interval a, Interval b) {
  const double p[] = {times(a.lo, b.lo), times(a.lo, b.hi), times(a.hi, b.lo), times(a.hi, b.hi)};
  return {std::min({p[0], p[1], p[2], p[3]}), std::max({p[0], p[1], p[2], p[3]})};
}

Interval operator/(Interval a, Interval b) {
  if (b.lo <= 0 && b.hi >= 0) return Interval::everything();
  return a * Interval(1 / b.hi, 1 / b.lo);
}

Interval cos(Interval a) { return sin(a + Interval(kPi / 2)); }

Interval sin(Interval a) {
  if (!(a.hi - a.lo < 2 * kPi)) return {-1, 1};
  const double s = std::sin(a.lo), e = std::sin(a.hi);
  Interval r(std::min(s, e), std::max(s, e));
  // A crest π/2 + 2πk or a trough −π/2 + 2πk inside reaches the full range.
  const auto holds = [&](double phase) { return phase + 2 * kPi * std::ceil((a.lo - phase) / (2 * kPi)) <= a.hi; };
  if (holds(kPi / 2)) r.hi = 1;
  if (holds(-kPi / 2)) r.lo = -1;
  // Rounding of large arguments may hide a crest: widen by it.
  const double slack = 4e-16 * std::max(std::abs(a.lo), std::abs(a.hi));
  return {std::max(-1.0, r.lo - slack), std::min(1.0, r.hi + slack)};
}

Interval log(Interval a) { return {a.lo > 0 ? std::log(a.lo) : -kInfinity, a.hi > 0 ? std::log(a.hi) : -kInfinity}; }

Interval hull(Interval a, Interval b) { return {std::min(a.lo, b.lo), std::max(a.hi, b.hi)}; }

}  // namespace meniscus::field
