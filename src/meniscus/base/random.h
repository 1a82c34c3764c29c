#pragma once

#include <array>
#include <cstdint>

namespace meniscus {

/// Four independent random numbers, uniform in [0, 1), that depend on (seed, id, step) alone: counter-based (Philox-4x64),
/// so the order in which threads draw does not matter.
std::array<double, 4> random_uniform(std::uint64_t seed, std::uint64_t id, std::uint64_t step);

}  // namespace meniscus
