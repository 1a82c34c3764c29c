#pragma once

// Private to combine.cpp and combine.avx2.cpp.
#include <meniscus/field/jets.h>
#include <meniscus/field/packet.h>

namespace meniscus::field {

/// a = smooth_least(a, sign·b, k) for `size` points; k = 0 is the sharp minimum. `k_rate` is k's rate per second.
using Fold = void (*)(const JetView& a, const JetView& b, double sign, double k, double k_rate);
extern const Fold kFoldAvx2;

namespace kernel {

/// min(a, b) rounded over a width k: min − k h³/6, h = (1 − |a−b|/k)₊. Twice differentiable; equals the minimum bit for bit
/// where the inputs differ by k or more.
template <class S, class K>
S smooth_least(const S& a, const S& b, const K& k) {
  const auto swap = jet::value(b) < jet::value(a);
  const S low = select(swap, b, a), high = select(swap, a, b);
  const S h = jet::positive_part(1.0 - (high - low) / k);
  return low - k * (h * h * h) * (1.0 / 6.0);
}

/// Reads the jets of a packet of points.
template <class J, class T>
J load_jet(const JetView& from, std::size_t i, std::size_t lanes) {
  if constexpr (!jet::AnyJet<J>) {
    return packet::load<T>(from.row(kF) + i, lanes);
  } else {
    J j;
    j.v = packet::load<T>(from.row(kF) + i, lanes);
    for (int a = 0; a < 3; ++a) j.d[a] = packet::load<T>(from.row(kFx + static_cast<std::size_t>(a)) + i, lanes);
    if constexpr (J::kFirst > 3) j.d[3] = packet::load<T>(from.row(kFt) + i, lanes);
    if constexpr (J::kSecond > 0)
      for (int k = 0; k < J::kSecond; ++k) j.h[k] = packet::load<T>(from.row(packet::kSecondRow[k]) + i, lanes);
    return j;
  }
}

template <class J, class T>
void fold_as(const JetView& a, const JetView& b, double sign, double k, double k_rate) {
  const T flip(sign);
  for (std::size_t i = 0; i < a.size; i += T::size) {
    const std::size_t lanes = packet::lanes<T>(a.size - i);
    const J x = load_jet<J, T>(a, i, lanes);
    const J y = load_jet<J, T>(b, i, lanes) * flip;
    J r;
    if (k <= 0) {
      r = jet::least(x, y);
    } else {
      if constexpr (jet::AnyJet<J>) {
        if constexpr (J::kFirst > 3)
          r = smooth_least(x, y, packet::moving<J>(k, k_rate));
        else
          r = smooth_least(x, y, T(k));
      } else {
        r = smooth_least(x, y, T(k));
      }
    }
    packet::store(r, true, a, i, lanes);
  }
}

template <class T>
void fold(const JetView& a, const JetView& b, double sign, double k, double k_rate) {
  switch (a.order) {
    case Order::Value: fold_as<T, T>(a, b, sign, k, k_rate); break;
    case Order::Gradient: fold_as<jet::Jet1<T, 3>, T>(a, b, sign, k, k_rate); break;
    case Order::GradientTime: fold_as<jet::Jet1<T, 4>, T>(a, b, sign, k, k_rate); break;
    case Order::Hessian: fold_as<jet::Jet2<T, 3>, T>(a, b, sign, k, k_rate); break;
    case Order::HessianTime: fold_as<jet::Jet2<T, 4>, T>(a, b, sign, k, k_rate); break;
  }
}

}  // namespace kernel
}  // namespace meniscus::field
