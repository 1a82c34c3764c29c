#pragma once

#include <meniscus/base/vec.h>

#include <array>
#include <bit>
#include <cstdint>

namespace meniscus::render {

/// What a pair of random numbers is for. Each use has its own well-spread sequence.
enum class Use : std::uint32_t { Pixel, Time, Key, Dome, BounceKey, Mirror, MirrorKey, MirrorDome };
inline constexpr std::size_t kUses = 8;

/// Well-spread pairs of random numbers for the rays of one pixel.
///
/// All pixels share one scrambled Sobol (0,2)-sequence for each use [Burley 2020, "Practical hash-based Owen scrambling"],
/// handed out along a shuffled quadtree of the picture: not only the samples of a pixel, but also those of any square of
/// pixels complement one another, so that what noise is left is fine-grained [Ahmed, Wonka 2020, "Screen-space blue-noise
/// diffusion of Monte Carlo sampling error via hierarchical ordering of pixels"]. Depends on the arguments alone, so the
/// order of the work does not matter.
class PixelSampler {
 public:
  /// `samples` pairs will be asked for of each use.
  PixelSampler(std::uint64_t seed, std::uint32_t x, std::uint32_t y, std::uint32_t samples) {
    const int shift = std::bit_width(samples - 1);
    mask_ = static_cast<std::uint32_t>((std::uint64_t{1} << shift) - 1);
    for (std::size_t use = 0; use < kUses; ++use) {
      const std::uint64_t key = mix(mix(seed) + use);
      const auto [order, leaf] = quadtree_order(x, y, key);
      const auto first = static_cast<std::uint32_t>(std::uint64_t{order} << shift);
      starts_[use] = {reversed(first), second_sobol(first), static_cast<std::uint32_t>(key),
                      static_cast<std::uint32_t>(key >> 32), leaf};
    }
  }

  /// Two numbers in [0, 1) for the given one of the samples.
  Vec2 pair(Use use, std::uint32_t sample) const {
    const Start& start = starts_[static_cast<std::size_t>(use)];
    // Each use takes the samples of the pixel in an order of its own, or pairs of different uses would hang together.
    const std::uint32_t i = scramble(sample, start.shuffle) & mask_;
    // Both sequences are linear over bits, and `i` has none in common with the start.
    const std::uint32_t x = scramble(start.x ^ reversed(i), start.seed_x);
    const std::uint32_t y = scramble(start.y ^ second_sobol(i), start.seed_y);
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

  struct Place {
    std::uint32_t order, leaf;
  };

  // The place of a pixel along a quadtree of the picture whose four children are shuffled in every node, and a hash of it.
  static Place quadtree_order(std::uint32_t x, std::uint32_t y, std::uint64_t key) {
    std::uint32_t order = 0;
    std::uint64_t node = key;
    for (int level = 15; level >= 0; --level) {
      const std::uint32_t child = ((x >> level) & 1U) | (((y >> level) & 1U) << 1);
      node = mix(node);
      // Mirror images and a swap: eight of the 24 orders.
      const std::uint32_t turned = child ^ static_cast<std::uint32_t>(node & 3U);
      const std::uint32_t swapped = (node & 4U) != 0 ? ((turned & 1U) << 1) | (turned >> 1) : turned;
      order = (order << 2) | swapped;
      node += child;
    }
    return {order, static_cast<std::uint32_t>(mix(node))};
  }

  static std::uint32_t second_sobol(std::uint32_t i) {
    std::uint32_t x = 0;
    for (std::uint32_t v = 1U << 31; i != 0; i >>= 1, v ^= v >> 1) {
      if ((i & 1U) != 0) x ^= v;
    }
    return x;
  }

  struct Start {
    std::uint32_t x, y, seed_x, seed_y, shuffle;
  };
  std::array<Start, kUses> starts_;
  std::uint32_t mask_;
};

/// The pairs of one ray.
struct Sampler {
  const PixelSampler& pixel;
  std::uint32_t sample;

  Vec2 pair(Use use) const { return pixel.pair(use, sample); }
};

}  // namespace meniscus::render
