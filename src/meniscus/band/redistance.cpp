#include <meniscus/band/kernels.h>
#include <meniscus/band/redistance.h>
#include <meniscus/base/parallel.h>

#include <algorithm>

namespace meniscus::band {
namespace {

constexpr double kTolerance = 1e-4;  // voxels

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
