// Eigen has no AVX-512 without fused multiply-add, and nothing here needs its packets.
#define EIGEN_DONT_VECTORIZE
#if defined(__GNUC__) && !defined(__clang__)
// The compiler's own intrinsics start from registers that are left undefined on purpose.
#pragma GCC diagnostic ignored "-Wuninitialized"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#include <meniscus/sample/repulsion_kernel.h>

namespace meniscus::sample::repulsion_kernel {

Sums sums_avx512(const Input& in, std::uint32_t i, const std::uint32_t* list, std::uint32_t count) {
  return sums<xsimd::batch<double, xsimd::avx512f>>(in, i, list, count);
}

}  // namespace meniscus::sample::repulsion_kernel
