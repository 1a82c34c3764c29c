#pragma once

namespace meniscus::field {

/// Whether this processor runs AVX2 kernels. Results are the same bits with and without: the kernels use no fused
/// multiply-add.
inline bool has_avx2() {
  static const bool yes = __builtin_cpu_supports("avx2") != 0;
  return yes;
}

/// Whether this processor runs AVX-512 kernels (with doubles and 64-bit integers); the same bits again.
inline bool has_avx512() {
  static const bool yes = __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
                          __builtin_cpu_supports("avx512vl") != 0;
  return yes;
}

}  // namespace meniscus::field
