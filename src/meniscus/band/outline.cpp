#include <meniscus/band/outline.h>
#include <meniscus/base/parallel.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace meniscus::band {

Outlines outlines_of(const Band& band, const RunControl& run) {
  Outlines out(band.brick_count());
  parallel_for(out.size(), 64, run,
               [&](std::size_t b) { update_outline(band, band.values().data() + b * Band::kBrickNodes, out[b]); });
  return out;
}

void update_outline(const Band& band, const float* samples, Outline& out) {
  kernels().outline(samples, static_cast<float>(band.voxel()), out);
}

void remap_outlines(const Band& band, const std::vector<std::int32_t>& map, Outlines& outlines) {
  Outlines out(map.size());
  for (std::size_t b = 0; b < map.size(); ++b)
    if (map[b] >= 0)
      out[b] = outlines[static_cast<std::size_t>(map[b])];
    else
      update_outline(band, band.values().data() + b * Band::kBrickNodes, out[b]);
  outlines.swap(out);
}

Rows rows_within(const Outline& outline, double voxels) {
  constexpr std::uint64_t kOnes = 0x0101010101010101, kTops = 0x8080808080808080;
  const auto steps = static_cast<std::uint64_t>(std::clamp(std::ceil(voxels * Outline::kSteps), 0.0, 127.0));
  const auto words = std::bit_cast<std::array<std::uint64_t, 8>>(outline.nearest);
  Rows rows = 0;
  for (std::size_t d = 0; d < 8; ++d) {
    // The top bit of a byte stays where its number is at least `steps`; the others' bits are put together.
    const std::uint64_t far = ((words[d] | kTops) - steps * kOnes) & kTops;
    rows |= static_cast<Rows>(((far ^ kTops) >> 7) * 0x0102040810204080 >> 56) << (8 * d);
  }
  return rows;
}

RowLayers layers_within(const Outline& outline, double voxels) {
  const Rows all = rows_within(outline, voxels);
  RowLayers layers{};
  Rows nearer = 0;
  for (std::size_t l = 0; l < 3 && nearer != all; ++l) {
    const Rows within = rows_within(outline, static_cast<double>(l + 1)) & all;
    layers[l] = within & ~nearer;
    nearer = within;
  }
  layers[3] |= all & ~nearer;
  return layers;
}

std::vector<char> surface_bricks(const Band& band, const Outlines& outlines, const RunControl& run) {
  constexpr char kIn = 1, kOut = 2, kBoth = 3;
  std::vector<char> sides(outlines.size()), out(sides.size());
  for (std::size_t b = 0; b < sides.size(); ++b) {
    std::uint64_t any = 0, all = ~std::uint64_t{0};
    for (const std::uint64_t plane : outlines[b].inside) {
      any |= plane;
      all &= plane;
    }
    sides[b] = static_cast<char>((any != 0 ? kIn : 0) | (~all != 0 ? kOut : 0));
  }
  parallel_for(sides.size(), 64, run, [&](std::size_t b) {
    char seen = 0;
    for (const std::int32_t n : band.neighbours(b))
      seen |= n >= 0 ? sides[static_cast<std::size_t>(n)] : n == Band::kInside ? kIn : kOut;
    out[b] = seen == kBoth;
  });
  return out;
}

}  // namespace meniscus::band
