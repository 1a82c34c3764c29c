#pragma once

#include <immintrin.h>

/// Eight floats at once, for the kernels of this folder only. Everything has internal linkage: each source compiles its own
/// copy for its own processor (kernels.cpp: SSE2, kernels.avx2.cpp: AVX2). No operation is fused or reordered, so both give
/// the same bits.
namespace {

typedef float Float8 __attribute__((vector_size(32)));
typedef int Int8 __attribute__((vector_size(32)));  // results of comparisons: all bits or none
typedef float Float8Unaligned __attribute__((vector_size(32), aligned(4), may_alias));

#define MENISCUS_KERNEL_MEMBER inline __attribute__((always_inline))
#define MENISCUS_KERNEL_INLINE static MENISCUS_KERNEL_MEMBER

MENISCUS_KERNEL_INLINE Float8 load8(const float* p) { return *reinterpret_cast<const Float8Unaligned*>(p); }
MENISCUS_KERNEL_INLINE void store8(float* p, Float8 v) { *reinterpret_cast<Float8Unaligned*>(p) = v; }
MENISCUS_KERNEL_INLINE Float8 set8(float v) { return Float8{v, v, v, v, v, v, v, v}; }

#ifdef __AVX2__
MENISCUS_KERNEL_INLINE Float8 max8(Float8 a, Float8 b) { return _mm256_max_ps(a, b); }
MENISCUS_KERNEL_INLINE Float8 min8(Float8 a, Float8 b) { return _mm256_min_ps(a, b); }
MENISCUS_KERNEL_INLINE Float8 sqrt8(Float8 a) { return _mm256_sqrt_ps(a); }
/// A bit per lane in which the comparison holds.
MENISCUS_KERNEL_INLINE unsigned bits8(Int8 a) { return static_cast<unsigned>(_mm256_movemask_ps((__m256)a)); }
#else
union Halves8 {
  Float8 whole;
  __m128 half[2];
};
MENISCUS_KERNEL_INLINE Float8 max8(Float8 a, Float8 b) {
  Halves8 x{a}, y{b};
  x.half[0] = _mm_max_ps(x.half[0], y.half[0]);
  x.half[1] = _mm_max_ps(x.half[1], y.half[1]);
  return x.whole;
}
MENISCUS_KERNEL_INLINE Float8 min8(Float8 a, Float8 b) {
  Halves8 x{a}, y{b};
  x.half[0] = _mm_min_ps(x.half[0], y.half[0]);
  x.half[1] = _mm_min_ps(x.half[1], y.half[1]);
  return x.whole;
}
MENISCUS_KERNEL_INLINE Float8 sqrt8(Float8 a) {
  Halves8 x{a};
  x.half[0] = _mm_sqrt_ps(x.half[0]);
  x.half[1] = _mm_sqrt_ps(x.half[1]);
  return x.whole;
}
MENISCUS_KERNEL_INLINE unsigned bits8(Int8 a) {
  const Halves8 x{(Float8)a};
  return static_cast<unsigned>(_mm_movemask_ps(x.half[0]) | _mm_movemask_ps(x.half[1]) << 4);
}
#endif
/// The row shifted by a node; what enters comes from the row behind or ahead.
MENISCUS_KERNEL_INLINE Float8 before8(Float8 behind, Float8 a) {
  return __builtin_shufflevector(behind, a, 7, 8, 9, 10, 11, 12, 13, 14);
}
MENISCUS_KERNEL_INLINE Float8 after8(Float8 a, Float8 ahead) {
  return __builtin_shufflevector(a, ahead, 1, 2, 3, 4, 5, 6, 7, 8);
}
/// The second half of a row and the first half of the next.
MENISCUS_KERNEL_INLINE Float8 join8(Float8 a, Float8 ahead) {
  return __builtin_shufflevector(a, ahead, 4, 5, 6, 7, 8, 9, 10, 11);
}
MENISCUS_KERNEL_INLINE Float8 abs8(Float8 a) { return max8(a, -a); }
/// Rounded towards zero.
MENISCUS_KERNEL_INLINE Int8 truncated8(Float8 a) { return __builtin_convertvector(a, Int8); }
/// The nearer to zero of two values of one sign, 0 for values of opposite signs.
MENISCUS_KERNEL_INLINE Float8 minmod8(Float8 a, Float8 b) {
  const Float8 zero = set8(0);
  return max8(zero, min8(a, b)) + min8(zero, max8(a, b));
}

}  // namespace
