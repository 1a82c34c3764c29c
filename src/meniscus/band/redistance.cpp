#include <meniscus/band/kernels.h>
#include <meniscus/band/redistance.h>
#include <meniscus/base/parallel.h>

#include <algorithm>

namespace meniscus::band {
namespace {

constexpr double kTolerance = 1e-4;  // voxels

/// Bricks that may hold nodes next to the surface: both sides are seen in them or in a brick that they share a face with.
std::vector<char> surface_bricks(const Band& band, const RunControl& run) {
  constexpr char kIn = 1, kOut = 2, kBoth = 3;
  std::vector<char> sides(band.brick_count()), out(sides.size());
  parallel_for(sides.size(), 64, run, [&](std::size_t b) {
    NodeBits inside;
    kernels().inside(band.values().data() + b * Band::kBrickNodes, inside);
    std::uint64_t any = 0, all = ~std::uint64_t{0};
    for (const std::uint64_t plane : inside) {
      any |= plane;
      all &= plane;
    }
    sides[b] = static_cast<char>((any != 0 ? kIn : 0) | (~all != 0 ? kOut : 0));
  });
  for (std::size_t b = 0; b < sides.size(); ++b) {
    out[b] = sides[b];
    for (const std::size_t d : {4u, 10u, 12u, 14u, 16u, 22u}) {
      const std::int32_t n = band.neighbours(b)[d];
      out[b] |= n >= 0 ? sides[static_cast<std::size_t>(n)] : n == Band::kInside ? kIn : kOut;
    }
    out[b] = out[b] == kBoth;
  }
  return out;
}

}  // namespace

RedistanceReport redistance(Band& band, const RunControl& run, int max_passes) {
  std::vector<float> room;
  return redistance(band, max_passes, room, run);
}

RedistanceReport redistance(Band& band, int max_passes, std::vector<float>& next, const RunControl& run) {
  const float voxel = static_cast<float>(band.voxel()), background = band.background();
  const Kernels& kernel = kernels();
  const auto slot = [](auto&& v, std::size_t brick) { return v.data() + brick * Band::kBrickNodes; };
  next.resize(band.values().size());

  // Nodes next to the surface first; all others start from what they have.
  const std::vector<char> near = surface_bricks(band, run);
  parallel_for(band.brick_count(), 16, run, [&](std::size_t brick) {
    if (near[brick] == 0) {
      std::copy_n(slot(band.values(), brick), Band::kBrickNodes, slot(next, brick));
      return;
    }
    Halo halo;
    gather_halo(band, band.values().data(), brick, background, -background, halo);
    kernel.rescale(halo, voxel, slot(next, brick));
  });
  band.swap_values(next);

  RedistanceReport report;
  while (report.passes < max_passes) {
    const float change = parallel_reduce(
        band.brick_count(), 16, run, 0.0f,
        [&](std::size_t begin, std::size_t end) {
          float largest = 0;
          Halo halo;
          for (std::size_t brick = begin; brick < end; ++brick) {
            gather_star(band, band.values().data(), brick, background, -background, halo);
            largest = std::max(largest, kernel.eikonal(halo, voxel, background));
            kernel.centre(halo, slot(next, brick));
          }
          return largest;
        },
        [](float a, float b) { return std::max(a, b); });
    band.swap_values(next);
    ++report.passes;
    report.last_change = static_cast<double>(change) / band.voxel();
    if (report.last_change < kTolerance) break;
  }
  return report;
}

}  // namespace meniscus::band
