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

RedistanceReport redistance(Band& band, int max_passes, std::vector<float>& room, const RunControl& run) {
  Outlines outlines = outlines_of(band, run);
  rescale_distances(band, outlines, room, run);
  RedistanceReport report;
  while (report.passes < max_passes) {
    report.last_change = static_cast<double>(spread_distances(band, outlines, Band::kHalfWidth, room, run)) / band.voxel();
    ++report.passes;
    if (report.last_change < kTolerance) break;
  }
  return report;
}

void rescale_distances(Band& band, Outlines& outlines, std::vector<float>& next, const RunControl& run) {
  const float voxel = static_cast<float>(band.voxel()), background = band.background();
  next.resize(band.values().size());
  const std::vector<char> near = surface_bricks(band, outlines, run);
  parallel_for(band.brick_count(), 16, run, [&](std::size_t brick) {
    const std::size_t n = brick * Band::kBrickNodes;
    if (near[brick] == 0) {
      std::copy_n(band.values().data() + n, Band::kBrickNodes, next.data() + n);
      return;
    }
    Halo halo;
    gather_halo(band, band.values().data(), brick, background, -background, halo);
    kernels().rescale(halo, voxel, next.data() + n);
    update_outline(band, next.data() + n, outlines[brick]);
  });
  band.swap_values(next);
}

float spread_distances(Band& band, Outlines& outlines, double reach, std::vector<float>& next, const RunControl& run) {
  const float voxel = static_cast<float>(band.voxel()), background = band.background();
  const Kernels& kernel = kernels();
  next.resize(band.values().size());
  // At the rim samples do not tell how far they are from coming into the band.
  const double within = reach < Band::kHalfWidth ? reach : 2 * Band::kHalfWidth;
  const float change = parallel_reduce(
      band.brick_count(), 16, run, 0.0f,
      [&](std::size_t begin, std::size_t end) {
        float largest = 0;
        Halo halo;
        for (std::size_t brick = begin; brick < end; ++brick) {
          float* out = next.data() + brick * Band::kBrickNodes;
          const RowLayers rows = layers_within(outlines[brick], within);
          if (rows == RowLayers{}) {
            std::copy_n(band.values().data() + brick * Band::kBrickNodes, Band::kBrickNodes, out);
            continue;
          }
          gather_star(band, band.values().data(), brick, background, -background, halo);
          largest = std::max(largest, kernel.eikonal(halo, voxel, background, rows));
          kernel.centre(halo, out);
          update_outline(band, out, outlines[brick]);
        }
        return largest;
      },
      [](float a, float b) { return std::max(a, b); });
  band.swap_values(next);
  return change;
}

}  // namespace meniscus::band
