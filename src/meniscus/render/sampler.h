#pragma once

#include <meniscus/base/vec.h>

#include <cstdint>

namespace meniscus::render {

/// What a pair of random numbers is for. Each use has its own well-spread sequence.
enum class Use : std::uint32_t { Pixel, Time, Key, Dome, BounceKey, Mirror, MirrorKey, MirrorDome };

/// Well-spread pairs for one ray of one pixel: a Sobol (0,2)-sequence, scrambled and shuffled by hashes of (seed, pixel,
/// use) [Burley 2020, "Practical hash-based Owen scrambling"]. Depends on nothing else, so the order of the work does not
/// matter.
class Sampler {
 public:
  Sampler(std::uint64_t seed, std::uint64_t pixel, std::uint32_t sample) : key_(mix(seed ^ mix(pixel))), sample_(sample) {}

  /// Two numbers in [0, 1).
  Vec2 pair(Use use) const {
    const std::uint64_t key = mix(key_ + static_cast<std::uint64_t>(use));
    const std::uint32_t i = scramble(sample_, static_cast<std::uint32_t>(key));
    const std::uint64_t more = mix(key);
    const std::uint32_t x = scramble(reversed(i), static_cast<std::uint32_t>(more));
    const std::uint32_t y = scramble(second_sobol(i), static_cast<std::uint32_t>(more >> 32));
    return Vec2(x, y) * 0x1.0p-32;
  }

 private:
  // The finaliser of splitmix64.
  static std::uint64_t mix(std::uint64_t x) {
    x += 0x9e3779b97f4a7c15ULL;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
    return x ^ (x >> 31);
  }

  static std::uint32_t reversed(std::uint32_t x) {
    x = __builtin_bswap32(x);
    x = ((x & 0x0f0f0f0fU) << 4) | ((x >> 4) & 0x0f0f0f0fU);
    x = ((x & 0x33333333U) << 2) | ((x >> 2) & 0x33333333U);
    return ((x & 0x55555555U) << 1) | ((x >> 1) & 0x55555555U);
  }

  // Owen scrambling of the bits, most significant first: in the reversed word every operation only carries upwards
  // [Laine, Karras 2011].
  static std::uint32_t scramble(std::uint32_t x, std::uint32_t seed) {
    x = reversed(x) + seed;
    x ^= x * 0x6c50b47cU;
    x ^= x * 0xb82f1e52U;
    x ^= x * 0xc7afe638U;
    x ^= x * 0x8d22f6e6U;
    return reversed(x);
  }

  static std::uint32_t second_sobol(std::uint32_t i) {
    std::uint32_t x = 0;
    for (std::uint32_t v = 1U << 31; i != 0; i >>= 1, v ^= v >> 1) {
      if ((i & 1U) != 0) x ^= v;
    }
    return x;
  }

  std::uint64_t key_;
  std::uint32_t sample_;
};

}  // namespace meniscus::render
