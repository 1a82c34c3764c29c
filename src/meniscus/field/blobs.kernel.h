#pragma once

// Private to blobs.cpp and blobs.avx2.cpp.
#include <meniscus/field/exponential.h>
#include <meniscus/field/jets.h>
#include <meniscus/field/packet.h>
#include <meniscus/field/shapes.h>

#include <cmath>
#include <cstdint>
#include <type_traits>

namespace meniscus::field {

namespace shapes {

/// exp(−u) and its derivatives. Cut where it falls below 2^-53.
struct Gaussian {
  static constexpr double kReach2 = 36.7368005696771;
  template <class T>
  static void at(const T& u, T& f, T& f1, T& f2) {
    if constexpr (std::is_same_v<T, double>)
      f = std::exp(-u);
    else
      f = packet::exponential(-u);
    f1 = -f;
    f2 = f;
  }
};

/// (1−u)³ and its derivatives.
struct Compact {
  static constexpr double kReach2 = 1;
  template <class T>
  static void at(const T& u, T& f, T& f1, T& f2) {
    const T m = T(1.0) - u;
    f = m * m * m;
    f1 = T(-3.0) * m * m;
    f2 = T(6.0) * m;
  }
};

}  // namespace shapes

/// The blobs in the order of the index, one array per number: coordinates of the centre (3) or of both ends (6), 1/radius²,
/// weight. Rates are null when all is at rest.
struct BlobArrays {
  static constexpr int kMost = 8;
  const double* q[kMost];
  const double* rate[kMost];
  bool moving;
};

struct BlobRange {
  std::uint32_t begin;
  std::uint32_t end;
};

/// out = bias − Σ over the ranges.
using SumBlobs = void (*)(const BlobArrays& blobs, const BlobRange* ranges, std::size_t count, const double (&bias)[2],
                          const Positions& x, const JetView& out);
/// Indexed by [segments][kernel].
using SumBlobsTable = SumBlobs[2][2];
extern const SumBlobsTable kSumBlobsAvx2;
extern const SumBlobsTable kSumBlobsAvx512;

namespace kernel {

using jet::AnyJet;

/// u = d²/radius² of a blob about a point, as a jet, from d = x − c: its structure is known, so nothing is multiplied by the
/// zeros and ones of coordinates.
struct Point {
  static constexpr int kCoordinates = 3;

  template <class T>
  static T argument(const T* x, const BlobArrays& b, std::uint32_t i) {
    const T dx = x[0] - T(b.q[0][i]), dy = x[1] - T(b.q[1][i]), dz = x[2] - T(b.q[2][i]);
    return (dx * dx + dy * dy + dz * dz) * T(b.q[3][i]);
  }

  template <AnyJet J, class T>
  static J argument_jet(const T* x, const BlobArrays& b, std::uint32_t i) {
    const T inv(b.q[3][i]);
    const T d[3] = {x[0] - T(b.q[0][i]), x[1] - T(b.q[1][i]), x[2] - T(b.q[2][i])};
    const T d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    J u = jet::constant<J>(d2 * inv);
    const T twice = inv + inv;
    for (int a = 0; a < 3; ++a) u.d[a] = twice * d[a];
    if constexpr (J::kSecond > 0) u.h[0] = u.h[3] = u.h[5] = twice;
    if constexpr (J::kFirst > 3) {
      const T v[3] = {T(b.rate[0][i]), T(b.rate[1][i]), T(b.rate[2][i])}, inv_t(b.rate[3][i]);
      u.d[3] = d2 * inv_t - twice * (d[0] * v[0] + d[1] * v[1] + d[2] * v[2]);
      if constexpr (J::kSecond > 0)
        for (int a = 0; a < 3; ++a) u.h[6 + a] = (inv_t + inv_t) * d[a] - twice * v[a];
    }
    return u;
  }
};

struct Segment {
  static constexpr int kCoordinates = 6;

  template <class T>
  static T argument(const T* x, const BlobArrays& b, std::uint32_t i) {
    T q[6];
    for (int k = 0; k < 6; ++k) q[k] = T(b.q[k][i]);
    return shapes::segment_distance_squared(x, q) * T(b.q[6][i]);
  }

  template <AnyJet J, class T>
  static J argument_jet(const T* point, const BlobArrays& b, std::uint32_t i) {
    J x[3];
    for (int a = 0; a < 3; ++a) x[a] = jet::variable<J>(point[a], a);
    if constexpr (J::kFirst > 3) {
      J q[6];
      for (int k = 0; k < 6; ++k) q[k] = packet::moving<J>(b.q[k][i], b.rate[k][i]);
      return shapes::segment_distance_squared(x, q) * packet::moving<J>(b.q[6][i], b.rate[6][i]);
    } else {
      T q[6];
      for (int k = 0; k < 6; ++k) q[k] = T(b.q[k][i]);
      return shapes::segment_distance_squared(x, q) * T(b.q[6][i]);
    }
  }
};

/// One blob's term as a number of type S, where `reached` holds.
template <class Geometry, class Kernel, class S, class T, class M>
S term(const T* x, const T& u, const M& reached, const BlobArrays& b, std::uint32_t i) {
  constexpr int kWeight = Geometry::kCoordinates + 1;
  const T w = select(reached, T(b.q[kWeight][i]), T(0.0));
  const T inside = select(reached, u, T(0.0));
  T f, f1, f2;
  Kernel::at(inside, f, f1, f2);
  if constexpr (!AnyJet<S>) {
    return w * f;
  } else {
    const S argument = Geometry::template argument_jet<S>(x, b, i);
    S r = jet::chain(argument, T(w * f), T(w * f1), T(w * f2));
    if constexpr (S::kFirst > 3) {
      const T rate = select(reached, T(b.rate[kWeight][i]), T(0.0));
      r.d[3] = r.d[3] + rate * f;
      if constexpr (S::kSecond > 0)
        for (int a = 0; a < 3; ++a) r.h[6 + a] = r.h[6 + a] + rate * f1 * argument.d[a];
    }
    return r;
  }
}

template <class Geometry, class Kernel, class S, class T>
void sum_as(const BlobArrays& b, const BlobRange* ranges, std::size_t count, const double (&bias)[2], const Positions& x,
            const JetView& out) {
  for (std::size_t p = 0; p < x.size; p += T::size) {
    const std::size_t lanes = packet::lanes<T>(x.size - p);
    const T point[3] = {packet::load<T>(x.x + p, lanes), packet::load<T>(x.y + p, lanes), packet::load<T>(x.z + p, lanes)};
    S total;
    if constexpr (AnyJet<S>) {
      total = jet::constant<S>(T(bias[0]));
      if constexpr (S::kFirst > 3) total.d[3] = T(bias[1]);
    } else {
      total = T(bias[0]);
    }
    for (std::size_t r = 0; r < count; ++r)
      for (std::uint32_t i = ranges[r].begin; i < ranges[r].end; ++i) {
        const T u = Geometry::argument(point, b, i);
        const auto reached = u < T(Kernel::kReach2);
        if (!xsimd::any(reached)) continue;
        total = total - term<Geometry, Kernel, S>(point, u, reached, b, i);
      }
    packet::store(total, b.moving, out, p, lanes);
  }
}

template <class Geometry, class Kernel, class T>
void sum(const BlobArrays& b, const BlobRange* ranges, std::size_t count, const double (&bias)[2], const Positions& x,
         const JetView& out) {
  const bool time = b.moving && has_time(out.order);
  if (out.order == Order::Value)
    sum_as<Geometry, Kernel, T, T>(b, ranges, count, bias, x, out);
  else if (!has_hessian(out.order))
    time ? sum_as<Geometry, Kernel, jet::Jet1<T, 4>, T>(b, ranges, count, bias, x, out)
         : sum_as<Geometry, Kernel, jet::Jet1<T, 3>, T>(b, ranges, count, bias, x, out);
  else
    time ? sum_as<Geometry, Kernel, jet::Jet2<T, 4>, T>(b, ranges, count, bias, x, out)
         : sum_as<Geometry, Kernel, jet::Jet2<T, 3>, T>(b, ranges, count, bias, x, out);
}

}  // namespace kernel

#define MENISCUS_SUM_BLOBS_TABLE(T)                                                                       \
  {                                                                                                       \
    {kernel::sum<kernel::Point, shapes::Gaussian, T>, kernel::sum<kernel::Point, shapes::Compact, T>}, {  \
      kernel::sum<kernel::Segment, shapes::Gaussian, T>, kernel::sum<kernel::Segment, shapes::Compact, T> \
    }                                                                                                     \
  }

}  // namespace meniscus::field
