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
/// Box of some points; coordinates that are not numbers are passed over.
struct PointBox {
  double low[3], high[3];

  explicit PointBox(const Positions& p) {
    const double* axes[3] = {p.x, p.y, p.z};
    for (int a = 0; a < 3; ++a) {
      low[a] = HUGE_VAL;
      high[a] = -HUGE_VAL;
      for (std::size_t i = 0; i < p.size; ++i) {
        low[a] = axes[a][i] < low[a] ? axes[a][i] : low[a];
        high[a] = axes[a][i] > high[a] ? axes[a][i] : high[a];
      }
    }
  }
};
using NarrowBlobs = std::size_t (*)(const BlobArrays& blobs, std::size_t count, const PointBox& box, double reach2,
                                    BlobRange* out);

struct BlobKernels {
  SumBlobs sum[2][2];  ///< [segments][kernel]
  NarrowBlobs narrow;
};
extern const BlobKernels kBlobsAvx2;
extern const BlobKernels kBlobsAvx512;

namespace kernel {

using jet::AnyJet;

/// A blob about a point. The structure of u = d²/radius², d = x − c, is known, so nothing is multiplied by the zeros and
/// ones of coordinates.
struct Point {
  static constexpr int kCoordinates = 3;

  template <class T>
  static T argument(const T* x, const BlobArrays& b, std::uint32_t i) {
    const T dx = x[0] - T(b.q[0][i]), dy = x[1] - T(b.q[1][i]), dz = x[2] - T(b.q[2][i]);
    return (dx * dx + dy * dy + dz * dz) * T(b.q[3][i]);
  }

  /// total −= w k(u), where w, its rate and u are zero unless the blob reaches. With s = 2/radius², ∇u = s d and H u = s I.
  template <class Kernel, AnyJet J, class T>
  static void subtract(J& total, const T* x, const T& w, const T& w_t, const T& u, const BlobArrays& b, std::uint32_t i) {
    T f, f1, f2;
    Kernel::at(u, f, f1, f2);
    const T inv(b.q[3][i]), s = inv + inv, first = w * f1 * s;
    const T d[3] = {x[0] - T(b.q[0][i]), x[1] - T(b.q[1][i]), x[2] - T(b.q[2][i])};
    total.v = total.v - w * f;
    for (int a = 0; a < 3; ++a) total.d[a] = total.d[a] - first * d[a];
    [[maybe_unused]] T u_t, second_d[3];
    if constexpr (J::kFirst > 3) {
      const T inv_t(b.rate[3][i]), v[3] = {T(b.rate[0][i]), T(b.rate[1][i]), T(b.rate[2][i])};
      const T d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
      u_t = d2 * inv_t - s * (d[0] * v[0] + d[1] * v[1] + d[2] * v[2]);
      total.d[3] = total.d[3] - (w * f1 * u_t + w_t * f);
    }
    if constexpr (J::kSecond > 0) {
      const T second = w * f2 * s * s;
      for (int a = 0; a < 3; ++a) second_d[a] = second * d[a];
      for (int k = 0; k < 6; ++k) {
        const T mixed = second_d[jet::kRow[k]] * d[jet::kColumn[k]];
        total.h[k] = total.h[k] - (jet::kRow[k] == jet::kColumn[k] ? mixed + first : mixed);
      }
    }
    if constexpr (J::kSecond > 6) {
      const T inv_t(b.rate[3][i]), s_t = inv_t + inv_t;
      for (int a = 0; a < 3; ++a)
        total.h[6 + a] =
            total.h[6 + a] - (w * f1 * (s_t * d[a] - s * T(b.rate[a][i])) + s * d[a] * (w * f2 * u_t + w_t * f1));
    }
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

  /// total −= w k(u), where w, its rate and u are zero unless the blob reaches.
  template <class Kernel, AnyJet J, class T>
  static void subtract(J& total, const T* x, const T& w, const T& w_t, const T& u, const BlobArrays& b, std::uint32_t i) {
    T f, f1, f2;
    Kernel::at(u, f, f1, f2);
    const J argument = argument_jet<J>(x, b, i);
    J r = jet::chain(argument, T(w * f), T(w * f1), T(w * f2));
    if constexpr (J::kFirst > 3) {
      r.d[3] = r.d[3] + w_t * f;
      if constexpr (J::kSecond > 0)
        for (int a = 0; a < 3; ++a) r.h[6 + a] = r.h[6 + a] + w_t * f1 * argument.d[a];
    }
    total = total - r;
  }
};

/// total −= the term of blob i, where `reached` holds.
template <class Geometry, class Kernel, class S, class T, class M>
void subtract(S& total, const T* x, const T& u, const M& reached, const BlobArrays& b, std::uint32_t i) {
  constexpr int kWeight = Geometry::kCoordinates + 1;
  const T zero(0.0), w = select(reached, T(b.q[kWeight][i]), zero), inside = select(reached, u, zero);
  if constexpr (AnyJet<S>) {
    T w_t = zero;
    if constexpr (S::kFirst > 3) w_t = select(reached, T(b.rate[kWeight][i]), zero);
    Geometry::template subtract<Kernel>(total, x, w, w_t, inside, b, i);
  } else {
    T f, f1, f2;
    Kernel::at(inside, f, f1, f2);
    total = total - w * f;
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
        subtract<Geometry, Kernel>(total, point, u, reached, b, i);
      }
    packet::store(total, b.moving, out, p, lanes);
  }
}

/// Puts into `out` (room for `count`) the runs of the first `count` point blobs whose reach, in radii² at most `reach2`,
/// meets the box. Returns how many.
template <class T>
std::size_t narrow(const BlobArrays& b, std::size_t count, const PointBox& box, double reach2, BlobRange* out) {
  std::size_t runs = 0;
  alignas(64) double u[T::size];
  for (std::uint32_t first = 0; first < count; first += T::size) {
    const std::size_t lanes = packet::lanes<T>(count - first);
    T d2(0.0);
    for (int a = 0; a < 3; ++a) {
      const T c = packet::load<T>(b.q[a] + first, lanes);
      const T away = xsimd::max(xsimd::max(T(box.low[a]) - c, c - T(box.high[a])), T(0.0));
      d2 = d2 + away * away;
    }
    d2 = d2 * packet::load<T>(b.q[3] + first, lanes);
    if (!xsimd::any(d2 <= T(reach2))) continue;
    d2.store_aligned(u);
    for (std::uint32_t k = 0; k < lanes; ++k) {
      if (!(u[k] <= reach2)) continue;
      if (runs == 0 || out[runs - 1].end != first + k) out[runs++] = {first + k, first + k};
      ++out[runs - 1].end;
    }
  }
  return runs;
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

template <class T>
constexpr BlobKernels table() {
  return {{{sum<Point, shapes::Gaussian, T>, sum<Point, shapes::Compact, T>},
           {sum<Segment, shapes::Gaussian, T>, sum<Segment, shapes::Compact, T>}},
          narrow<T>};
}

}  // namespace kernel
}  // namespace meniscus::field
