#pragma once

#include <meniscus/field/jet.h>

#include <array>
#include <cmath>

/// The definitions of the primitives, once, as templates: `x` is the position and `q` the slots, each a plain number, a SIMD
/// packet or a jet of either.
namespace meniscus::field::shapes {

using jet::greatest;
using jet::magnitude;
using jet::positive_part;
using jet::sqr;
using std::exp;
using std::sqrt;

template <class A, class B>
auto dot(const A* a, const B* b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <class X, class Q>
auto minus(const X* x, const Q* q) {
  return std::array{x[0] - q[0], x[1] - q[1], x[2] - q[2]};
}

template <class S>
S length(const S* a) {
  return sqrt(sqr(a[0]) + sqr(a[1]) + sqr(a[2]));
}

/// Slots: center, radius.
struct Sphere {
  static constexpr int kSlots = 4;
  template <class X, class Q>
  static auto value(const X* x, const Q* q) {
    const auto p = minus(x, q);
    return length(p.data()) - q[3];
  }
};

/// Slots: center, size.
struct Box {
  static constexpr int kSlots = 6;
  template <class X, class Q>
  static auto value(const X* x, const Q* q) {
    const auto p = minus(x, q);
    const std::array e{magnitude(p[0]) - q[3] * 0.5, magnitude(p[1]) - q[4] * 0.5, magnitude(p[2]) - q[5] * 0.5};
    const std::array o{positive_part(e[0]), positive_part(e[1]), positive_part(e[2])};
    const auto deepest = greatest(e[0], greatest(e[1], e[2]));
    return length(o.data()) + (deepest - positive_part(deepest));
  }
};

/// Slots: center, axis, major, minor.
struct Torus {
  static constexpr int kSlots = 8;
  template <class X, class Q>
  static auto value(const X* x, const Q* q) {
    const auto p = minus(x, q);
    const Q l = length(q + 3);
    const std::array<Q, 3> a{q[3] / l, q[4] / l, q[5] / l};
    const auto h = dot(p.data(), a.data());
    const std::array r{p[0] - h * a[0], p[1] - h * a[1], p[2] - h * a[2]};
    return sqrt(sqr(length(r.data()) - q[6]) + sqr(h)) - q[7];
  }
};

/// Where the segment q[0..2] q[3..5] is nearest to x, in [0, 1]; a segment of no length counts as a point.
template <class P, class Q>
auto segment_parameter(const P& p, const std::array<Q, 3>& ab) {
  const auto t = dot(p.data(), ab.data()) / (dot(ab.data(), ab.data()) + 1e-300);
  const auto above = positive_part(t);
  return above - positive_part(above - 1.0);
}

/// Squared distance to the segment q[0..2] q[3..5].
template <class X, class Q>
auto segment_distance_squared(const X* x, const Q* q) {
  const auto p = minus(x, q);
  const std::array<Q, 3> ab{q[3] - q[0], q[4] - q[1], q[5] - q[2]};
  const auto t = segment_parameter(p, ab);
  return sqr(p[0] - t * ab[0]) + sqr(p[1] - t * ab[1]) + sqr(p[2] - t * ab[2]);
}

/// Slots: a, b, radius.
struct Capsule {
  static constexpr int kSlots = 7;
  template <class X, class Q>
  static auto value(const X* x, const Q* q) {
    return sqrt(segment_distance_squared(x, q)) - q[6];
  }
};

/// Slots: point, normal.
struct Plane {
  static constexpr int kSlots = 6;
  template <class X, class Q>
  static auto value(const X* x, const Q* q) {
    const auto p = minus(x, q);
    return dot(p.data(), q + 3) / length(q + 3);
  }
};

/// Slots: center, radii.
struct Ellipsoid {
  static constexpr int kSlots = 6;
  template <class X, class Q>
  static auto value(const X* x, const Q* q) {
    const auto p = minus(x, q);
    const std::array u{p[0] / q[3], p[1] / q[4], p[2] / q[5]};
    return (length(u.data()) - 1.0) * (3.0 / (1.0 / q[3] + 1.0 / q[4] + 1.0 / q[5]));
  }
};

}  // namespace meniscus::field::shapes
