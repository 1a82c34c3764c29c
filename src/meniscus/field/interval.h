#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace meniscus::field {

/// A closed interval [lo, hi] with conservative arithmetic (up to rounding): primitives evaluated on it bound their values
/// over a box.
struct Interval {
  double lo = -std::numeric_limits<double>::infinity();
  double hi = std::numeric_limits<double>::infinity();

  Interval() = default;
  Interval(double value) : lo(value), hi(value) {}  // NOLINT(google-explicit-constructor): numbers are intervals
  Interval(double l, double h) : lo(l), hi(h) {}

  static Interval everything() { return {}; }
  bool contains(double v) const { return lo <= v && v <= hi; }
  bool contains_zero() const { return contains(0); }
};

inline Interval operator-(Interval a) { return {-a.hi, -a.lo}; }
inline Interval operator+(Interval a, Interval b) { return {a.lo + b.lo, a.hi + b.hi}; }
inline Interval operator-(Interval a, Interval b) { return {a.lo - b.hi, a.hi - b.lo}; }
Interval operator*(Interval a, Interval b);
Interval operator/(Interval a, Interval b);

inline Interval min(Interval a, Interval b) { return {std::min(a.lo, b.lo), std::min(a.hi, b.hi)}; }
inline Interval max(Interval a, Interval b) { return {std::max(a.lo, b.lo), std::max(a.hi, b.hi)}; }
inline Interval abs(Interval a) {
  if (a.lo >= 0) return a;
  if (a.hi <= 0) return -a;
  return {0, std::max(-a.lo, a.hi)};
}
inline Interval sqr(Interval a) {
  const Interval b = abs(a);
  return {b.lo * b.lo, b.hi * b.hi};
}
/// Negative parts count as zero.
inline Interval sqrt(Interval a) { return {std::sqrt(std::max(a.lo, 0.0)), std::sqrt(std::max(a.hi, 0.0))}; }
inline Interval exp(Interval a) { return {std::exp(a.lo), std::exp(a.hi)}; }
Interval sin(Interval a);
Interval cos(Interval a);
/// Of the part of `a` above zero.
Interval log(Interval a);
Interval hull(Interval a, Interval b);

}  // namespace meniscus::field
