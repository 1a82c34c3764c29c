#include <meniscus/field/cpu.h>
#include <meniscus/sample/repulsion.h>
#include <meniscus/sample/repulsion_kernel.h>

namespace meniscus::sample {

Repulsion repulsion(const SurfacePoints& p, std::span<const double> sigma, double alpha, std::size_t i,
                    std::span<const std::uint32_t> neighbours) {
  const repulsion_kernel::Input in{p.x.data(),   p.y.data(),  p.z.data(),
                                   p.nx.data(),  p.ny.data(), p.nz.data(),
                                   sigma.data(), alpha,       kRepulsionReach * kRepulsionReach};
  static const repulsion_kernel::Kernel kernel = field::has_avx512() ? repulsion_kernel::sums_avx512
                                                 : field::has_avx2() ? repulsion_kernel::sums_avx2
                                                                     : repulsion_kernel::sums<field::packet::Sse2>;
  const auto s = kernel(in, static_cast<std::uint32_t>(i), neighbours.data(), static_cast<std::uint32_t>(neighbours.size()));
  return {{s.px, s.py, s.pz}, s.energy, s.moment / (sigma[i] * sigma[i] * sigma[i])};
}

}  // namespace meniscus::sample
