#include <meniscus/sample/repulsion_kernel.h>

namespace meniscus::sample::repulsion_kernel {

Sums sums_avx2(const Input& in, std::uint32_t i, const std::uint32_t* list, std::uint32_t count) {
  return sums<xsimd::batch<double, xsimd::avx2>>(in, i, list, count);
}

}  // namespace meniscus::sample::repulsion_kernel
