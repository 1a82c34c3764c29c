#pragma once

// Loading, storing and seeding of SIMD packets and of jets of them. Private to the kernels.
#include <meniscus/field/jet.h>
#include <meniscus/field/jets.h>

#include <xsimd/xsimd.hpp>

#include <cstddef>

namespace meniscus::field::packet {

using Sse2 = xsimd::batch<double, xsimd::sse2>;

/// Lanes in use when `left` points remain.
template <class T>
std::size_t lanes(std::size_t left) {
  return left < T::size ? left : T::size;
}

/// Loads `lanes` numbers; further lanes repeat the first.
template <class T>
T load(const double* from, std::size_t lanes) {
  if (lanes == T::size) return T::load_unaligned(from);
  alignas(64) double buffer[T::size];
  for (std::size_t k = 0; k < T::size; ++k) buffer[k] = from[k < lanes ? k : 0];
  return T::load_aligned(buffer);
}

template <class T>
void store(const T& value, double* to, std::size_t lanes) {
  if (lanes == T::size) {
    value.store_unaligned(to);
    return;
  }
  alignas(64) double buffer[T::size];
  value.store_aligned(buffer);
  for (std::size_t k = 0; k < lanes; ++k) to[k] = buffer[k];
}

/// Coordinate number `axis` as the variable that derivatives are taken by.
template <class X, class T>
X coordinate(const T& value, int axis) {
  if constexpr (jet::AnyJet<X>)
    return jet::variable<X>(value, axis);
  else
    return value;
}

/// A number that changes with time: its rate is the derivative by the fourth variable.
template <class J>
J moving(double value, double rate) {
  using T = typename J::Scalar;
  J j = jet::constant<J>(T(value));
  j.d[3] = T(rate);
  return j;
}

inline constexpr JetRow kSecondRow[9] = {kFxx, kFxy, kFxz, kFyy, kFyz, kFzz, kFxt, kFyt, kFzt};

/// Stores a result that is a plain number or a jet of 3 or 4 variables into the rows that `out.order` asks for; the rows of
/// time are zero unless `moving`.
template <class S>
void store(const S& s, bool moving, const JetView& out, std::size_t i, std::size_t lanes) {
  if constexpr (!jet::AnyJet<S>) {
    store(s, out.row(kF) + i, lanes);
  } else {
    store(s.v, out.row(kF) + i, lanes);
    for (int a = 0; a < 3; ++a) store(s.d[a], out.row(kFx + static_cast<std::size_t>(a)) + i, lanes);
    if constexpr (S::kSecond > 0)
      for (int k = 0; k < 6; ++k) store(s.h[k], out.row(kSecondRow[k]) + i, lanes);
    if (!has_time(out.order)) return;
    using T = typename S::Scalar;
    const T zero(0.0);
    if constexpr (S::kFirst > 3) {
      store(moving ? s.d[3] : zero, out.row(kFt) + i, lanes);
      if constexpr (S::kSecond > 6)
        for (int k = 6; k < 9; ++k) store(moving ? s.h[k] : zero, out.row(kSecondRow[k]) + i, lanes);
    } else {
      store(zero, out.row(kFt) + i, lanes);
      if constexpr (S::kSecond > 0)
        for (int k = 6; k < 9; ++k) store(zero, out.row(kSecondRow[k]) + i, lanes);
    }
  }
}

}  // namespace meniscus::field::packet
