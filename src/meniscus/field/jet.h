#pragma once

#include <cmath>
#include <concepts>
#include <type_traits>

/// Forward-mode differentiation: numbers that carry derivatives. `T` is double or a SIMD packet. A primitive written once as
/// a function template gives its value on T, its gradient on Jet1<T, 3>, and so on. Everything here is inlined and templated
/// on T, so code compiled for different processors never shares a symbol.
namespace meniscus::field::jet {

inline double select(bool mask, double a, double b) { return mask ? a : b; }

/// Value and N first derivatives.
template <class T, int N>
struct Jet1 {
  using Scalar = T;
  static constexpr int kFirst = N;
  static constexpr int kSecond = 0;
  T v;
  T d[N];
};

/// Value, D first derivatives and second derivatives: D = 3 is (x, y, z) with the Hessian's six numbers; D = 4 adds t with
/// the three mixed ones (F_tt is left out: nothing needs it).
template <class T, int D>
struct Jet2 {
  static_assert(D == 3 || D == 4);
  using Scalar = T;
  static constexpr int kFirst = D;
  static constexpr int kSecond = D == 3 ? 6 : 9;
  T v;
  T d[D];
  T h[kSecond];
};

/// Which variables second derivative k belongs to: xx, xy, xz, yy, yz, zz, xt, yt, zt.
inline constexpr int kRow[9] = {0, 0, 0, 1, 1, 2, 0, 1, 2};
inline constexpr int kColumn[9] = {0, 1, 2, 1, 2, 2, 3, 3, 3};

template <class J>
concept AnyJet = requires {
  typename J::Scalar;
  { J::kFirst } -> std::convertible_to<int>;
  { J::kSecond } -> std::convertible_to<int>;
};

/// The constant `value`.
template <AnyJet J>
J constant(typename J::Scalar value) {
  J r;
  r.v = value;
  for (int i = 0; i < J::kFirst; ++i) r.d[i] = typename J::Scalar(0.0);
  if constexpr (J::kSecond > 0)
    for (int k = 0; k < J::kSecond; ++k) r.h[k] = typename J::Scalar(0.0);
  return r;
}

/// The variable number `index` at `value`.
template <AnyJet J>
J variable(typename J::Scalar value, int index) {
  J r = constant<J>(value);
  r.d[index] = typename J::Scalar(1.0);
  return r;
}

/// f(a) from f and its first two derivatives at a.v.
template <AnyJet J, class T = typename J::Scalar>
J chain(const J& a, const T& f, const T& f1, const T& f2) {
  J r;
  r.v = f;
  for (int i = 0; i < J::kFirst; ++i) r.d[i] = f1 * a.d[i];
  if constexpr (J::kSecond > 0)
    for (int k = 0; k < J::kSecond; ++k) r.h[k] = f1 * a.h[k] + f2 * a.d[kRow[k]] * a.d[kColumn[k]];
  return r;
}

/// f(a, b) from f and its derivatives at (a.v, b.v).
template <AnyJet J, class T = typename J::Scalar>
J chain(const J& a, const J& b, const T& f, const T& fa, const T& fb, const T& faa, const T& fab, const T& fbb) {
  J r;
  r.v = f;
  for (int i = 0; i < J::kFirst; ++i) r.d[i] = fa * a.d[i] + fb * b.d[i];
  if constexpr (J::kSecond > 0)
    for (int k = 0; k < J::kSecond; ++k) {
      const int i = kRow[k], j = kColumn[k];
      r.h[k] = fa * a.h[k] + fb * b.h[k] + faa * a.d[i] * a.d[j] + fab * (a.d[i] * b.d[j] + b.d[i] * a.d[j]) +
               fbb * b.d[i] * b.d[j];
    }
  return r;
}

template <AnyJet J>
J operator-(const J& a) {
  J r;
  r.v = -a.v;
  for (int i = 0; i < J::kFirst; ++i) r.d[i] = -a.d[i];
  if constexpr (J::kSecond > 0)
    for (int k = 0; k < J::kSecond; ++k) r.h[k] = -a.h[k];
  return r;
}

template <AnyJet J>
J operator+(const J& a, const J& b) {
  J r;
  r.v = a.v + b.v;
  for (int i = 0; i < J::kFirst; ++i) r.d[i] = a.d[i] + b.d[i];
  if constexpr (J::kSecond > 0)
    for (int k = 0; k < J::kSecond; ++k) r.h[k] = a.h[k] + b.h[k];
  return r;
}

template <AnyJet J>
J operator-(const J& a, const J& b) {
  J r;
  r.v = a.v - b.v;
  for (int i = 0; i < J::kFirst; ++i) r.d[i] = a.d[i] - b.d[i];
  if constexpr (J::kSecond > 0)
    for (int k = 0; k < J::kSecond; ++k) r.h[k] = a.h[k] - b.h[k];
  return r;
}

template <AnyJet J>
J operator*(const J& a, const J& b) {
  J r;
  r.v = a.v * b.v;
  for (int i = 0; i < J::kFirst; ++i) r.d[i] = a.v * b.d[i] + b.v * a.d[i];
  if constexpr (J::kSecond > 0)
    for (int k = 0; k < J::kSecond; ++k) {
      const int i = kRow[k], j = kColumn[k];
      r.h[k] = a.v * b.h[k] + b.v * a.h[k] + a.d[i] * b.d[j] + b.d[i] * a.d[j];
    }
  return r;
}

/// Plain numbers beside a jet: its scalar type, or double.
template <class S, class J>
concept PlainFor = AnyJet<J> &&(std::same_as<S, typename J::Scalar> || std::convertible_to<S, double>);

template <AnyJet J, PlainFor<J> S>
J operator+(J a, const S& s) {
  a.v = a.v + typename J::Scalar(s);
  return a;
}
template <AnyJet J, PlainFor<J> S>
J operator+(const S& s, J a) {
  a.v = typename J::Scalar(s) + a.v;
  return a;
}
template <AnyJet J, PlainFor<J> S>
J operator-(J a, const S& s) {
  a.v = a.v - typename J::Scalar(s);
  return a;
}
template <AnyJet J, PlainFor<J> S>
J operator-(const S& s, const J& a) {
  J r = -a;
  r.v = typename J::Scalar(s) - a.v;
  return r;
}
template <AnyJet J, PlainFor<J> S>
J operator*(const J& a, const S& s) {
  const typename J::Scalar f(s);
  J r;
  r.v = a.v * f;
  for (int i = 0; i < J::kFirst; ++i) r.d[i] = a.d[i] * f;
  if constexpr (J::kSecond > 0)
    for (int k = 0; k < J::kSecond; ++k) r.h[k] = a.h[k] * f;
  return r;
}
template <AnyJet J, PlainFor<J> S>
J operator*(const S& s, const J& a) {
  return a * s;
}

template <AnyJet J>
J reciprocal(const J& a) {
  using T = typename J::Scalar;
  const T f = T(1.0) / a.v;
  return chain(a, f, T(-(f * f)), T(T(2.0) * f * f * f));
}
template <AnyJet J>
J operator/(const J& a, const J& b) {
  J r = a * reciprocal(b);
  r.v = a.v / b.v;  // the quotient itself, rounded once
  return r;
}
template <AnyJet J, PlainFor<J> S>
J operator/(const J& a, const S& s) {
  const typename J::Scalar f(s);
  J r;
  r.v = a.v / f;
  for (int i = 0; i < J::kFirst; ++i) r.d[i] = a.d[i] / f;
  if constexpr (J::kSecond > 0)
    for (int k = 0; k < J::kSecond; ++k) r.h[k] = a.h[k] / f;
  return r;
}
template <AnyJet J, PlainFor<J> S>
J operator/(const S& s, const J& a) {
  return reciprocal(a) * s;
}

/// mask ? a : b, lane by lane, derivatives included.
template <class M, AnyJet J>
J select(const M& mask, const J& a, const J& b) {
  J r;
  r.v = select(mask, a.v, b.v);
  for (int i = 0; i < J::kFirst; ++i) r.d[i] = select(mask, a.d[i], b.d[i]);
  if constexpr (J::kSecond > 0)
    for (int k = 0; k < J::kSecond; ++k) r.h[k] = select(mask, a.h[k], b.h[k]);
  return r;
}

/// The number inside: itself for a plain one.
template <class S>
const auto& value(const S& s) {
  if constexpr (AnyJet<S>)
    return s.v;
  else
    return s;
}

template <class S>
S sqr(const S& a) {
  return a * a;
}

/// Square root with derivative 0 at 0, where the true one is infinite.
template <AnyJet J>
J sqrt(const J& a) {
  using T = typename J::Scalar;
  using std::sqrt;
  const T f = sqrt(a.v);
  const T f1 = select(a.v > T(0.0), T(T(0.5) / f), T(0.0));
  const T f2 = select(a.v > T(0.0), T(T(-0.5) * f1 / a.v), T(0.0));
  return chain(a, f, f1, f2);
}

template <AnyJet J>
J exp(const J& a) {
  using std::exp;
  const typename J::Scalar f = exp(a.v);
  return chain(a, f, f, f);
}

template <AnyJet J>
J sin(const J& a) {
  using T = typename J::Scalar;
  using std::cos;
  using std::sin;
  const T s = sin(a.v);
  return chain(a, s, T(cos(a.v)), T(-s));
}

template <AnyJet J>
J cos(const J& a) {
  using T = typename J::Scalar;
  using std::cos;
  using std::sin;
  const T c = cos(a.v);
  return chain(a, c, T(-sin(a.v)), T(-c));
}

/// Smaller of two; the first where equal.
template <class S>
S least(const S& a, const S& b) {
  return select(value(b) < value(a), b, a);
}
/// Larger of two; the first where equal.
template <class S>
S greatest(const S& a, const S& b) {
  return select(value(b) > value(a), b, a);
}
template <class S>
S magnitude(const S& a) {
  using T = std::remove_cvref_t<decltype(value(a))>;
  return select(value(a) < T(0.0), S(-a), a);
}
/// a above zero, else 0.
template <class S>
S positive_part(const S& a) {
  using T = std::remove_cvref_t<decltype(value(a))>;
  if constexpr (AnyJet<S>)
    return select(a.v > T(0.0), a, constant<S>(T(0.0)));
  else
    return select(a > T(0.0), a, T(0.0));
}

}  // namespace meniscus::field::jet
