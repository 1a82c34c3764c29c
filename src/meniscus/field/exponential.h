#pragma once

// Private to the kernels.
#include <xsimd/xsimd.hpp>

#include <cstdint>

namespace meniscus::field::packet {

/// exp(x) lane by lane for −700 <= x <= 700, to 1 ulp; other arguments give nonsense. Plain additions and multiplications in
/// one order: the same bits for every instruction set, and half the cost of one that answers for all arguments.
///
/// exp(x) = 2^n (1 + r + r² q(r)) with x = n ln 2 + r, |r| <= ln 2 / 2; q interpolates at Chebyshev nodes, to 2e-17 of exp.
template <class A>
xsimd::batch<double, A> exponential(const xsimd::batch<double, A>& x) {
  using T = xsimd::batch<double, A>;
  using Bits = xsimd::batch<std::int64_t, A>;
  const T shift(6755399441055744.0);  // 1.5 · 2^52: adding it rounds to an integer, held in the low bits
  const T shifted = x * T(1.4426950408889634) + shift;
  const T n = shifted - shift;
  // ln 2 in two parts, the first with 32 zero bits at its end: n times it is exact.
  const T r = (x - n * T(0.6931471803691238)) - n * T(1.9082149292705877e-10);
  // Pairs of terms first: a chain half as long lets several arguments be under way at once.
  const T r2 = r * r, r4 = r2 * r2;
  const T low = (T(0.5) + T(0x1.5555555555556p-3) * r) + (T(0x1.5555555553d68p-5) + T(0x1.11111111109b5p-7) * r) * r2;
  const T middle = (T(0x1.6c16c17889f40p-10) + T(0x1.a01a01a7c2f2ep-13) * r) +
                   (T(0x1.a019b9148739fp-16) + T(0x1.71de0db2eafc6p-19) * r) * r2;
  const T high = T(0x1.28917ca046b86p-22) + T(0x1.af389eeb9e5e9p-26) * r;
  const T q = low + (middle + high * r4) * r4;
  const T p = T(1.0) + (r + r2 * q);
  // The low bits of `shifted` hold n: into the exponent with them.
  return xsimd::bitwise_cast<T>(xsimd::bitwise_cast<Bits>(p) + (xsimd::bitwise_cast<Bits>(shifted) << 52));
}

}  // namespace meniscus::field::packet
