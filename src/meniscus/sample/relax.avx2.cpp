#include <meniscus/sample/relax_kernel.h>

namespace meniscus::sample::relax_kernel {

PairForce smooth_avx2(const PairInput& in, std::uint32_t i, const std::uint32_t* list, std::uint32_t count) {
  return pair_force<Smooth>(in, i, list, count);
}
PairForce contact_avx2(const PairInput& in, std::uint32_t i, const std::uint32_t* list, std::uint32_t count) {
  return pair_force<Contact>(in, i, list, count);
}

}  // namespace meniscus::sample::relax_kernel
