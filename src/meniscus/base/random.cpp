#include <meniscus/base/random.h>

#include <Random123/philox.h>

namespace meniscus {

std::array<double, 4> random_uniform(std::uint64_t seed, std::uint64_t id, std::uint64_t step) {
  using Philox = r123::Philox4x64;
  const Philox::ctr_type counter = {{id, step, 0, 0}};
  const Philox::key_type key = {{seed, 0}};
  const Philox::ctr_type bits = Philox()(counter, key);
  std::array<double, 4> u{};
  for (std::size_t i = 0; i < u.size(); ++i) u[i] = static_cast<double>(bits[i] >> 11) * 0x1.0p-53;
  return u;
}

}  // namespace meniscus
