#include <meniscus/sample/relax_kernel.h>

namespace meniscus::sample::relax_kernel {

PairForce smooth_avx2(const Neighbour* all, float half_reach, std::uint32_t i, const std::uint32_t* list,
                      std::size_t count) {
  return pair_force<Smooth>(all, half_reach, i, list, count);
}
PairForce contact_avx2(const Neighbour* all, float half_reach, std::uint32_t i, const std::uint32_t* list,
                       std::size_t count) {
  return pair_force<Contact>(all, half_reach, i, list, count);
}

}  // namespace meniscus::sample::relax_kernel
