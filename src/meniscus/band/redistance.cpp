#include <meniscus/band/kernels.h>
#include <meniscus/band/redistance.h>
#include <meniscus/base/parallel.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace meniscus::band {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
constexpr int kStrides[3] = {kHaloX, kHaloY, 1};
constexpr int kMaxPasses = 16;
constexpr double kTolerance = 1e-4;  // voxels

bool differs(float a, float b) { return (a < 0) != (b < 0); }

/// |∇φ| times the voxel at a node, by central differences; at a kink (two sheets that nearly touch) the side that crosses.
float slope(const float* p) {
  float sum = 0;
  for (const int s : kStrides) {
    const float left = p[0] - p[-s], right = p[s] - p[0];
    float d = 0.5f * (left + right);
    if ((left < 0) != (right < 0))
      d = std::max(differs(p[0], p[-s]) ? std::abs(left) : 0, differs(p[0], p[s]) ? std::abs(right) : 0);
    sum += d * d;
  }
  return std::sqrt(sum);
}

/// Distance along the nearest axis crossing, in voxels; a bound on the true distance. 2 when no axis crosses.
float axis_distance(const float* p) {
  float nearest = 2;
  for (const int s : kStrides)
    for (const int step : {-s, s})
      if (differs(p[0], p[step])) nearest = std::min(nearest, p[0] / (p[0] - p[step]));
  return nearest;
}

template <class NodeWork>
void for_nodes(const NodeWork& work) {
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 8; ++j)
      for (int k = 0; k < 8; ++k) work((i * 8 + j) * 8 + k, halo_at(i, j, k));
}

/// Slopes at the nodes next to the surface, NaN elsewhere.
std::vector<float> slopes(const Band& band, const RunControl& run) {
  std::vector<float> out(band.values().size());
  const float b = band.background();
  parallel_for(band.brick_count(), 16, run, [&](std::size_t brick) {
    float halo[kHaloSize];
    gather_halo(band, band.values().data(), brick, b, -b, halo);
    for_nodes([&](int n, int h) {
      out[brick * Band::kBrickNodes + static_cast<std::size_t>(n)] = axis_distance(halo + h) < 2 ? slope(halo + h) : kNone;
    });
  });
  return out;
}

/// Each known number becomes the mean of itself and its known neighbours.
std::vector<float> smoothed(const Band& band, const std::vector<float>& known, const RunControl& run) {
  std::vector<float> out(known.size(), kNone);
  parallel_for(band.brick_count(), 16, run, [&](std::size_t brick) {
    float halo[kHaloSize];
    gather_halo(band, known.data(), brick, kNone, kNone, halo);
    for_nodes([&](int n, int h) {
      if (std::isnan(halo[h])) return;
      float sum = halo[h], count = 1;
      for (const int s : kStrides)
        for (const int step : {-s, s})
          if (!std::isnan(halo[h + step])) {
            sum += halo[h + step];
            count += 1;
          }
      out[brick * Band::kBrickNodes + static_cast<std::size_t>(n)] = sum / count;
    });
  });
  return out;
}

}  // namespace

RedistanceReport redistance(Band& band, const RunControl& run) {
  const float voxel = static_cast<float>(band.voxel()), background = band.background();
  const std::vector<float> scale = smoothed(band, smoothed(band, slopes(band, run), run), run);

  // Nodes next to the surface first; all others start from what they have.
  std::vector<float> next(band.values().size());
  parallel_for(band.brick_count(), 16, run, [&](std::size_t brick) {
    float halo[kHaloSize];
    gather_halo(band, band.values().data(), brick, background, -background, halo);
    for_nodes([&](int n, int h) {
      const std::size_t at = brick * Band::kBrickNodes + static_cast<std::size_t>(n);
      const float f = halo[h];
      float d = std::abs(f);
      if (!std::isnan(scale[at])) d = voxel * std::min(std::abs(f) / std::max(scale[at], 1e-20f), axis_distance(halo + h));
      next[at] = std::copysign(d, f < 0 ? -1.0f : 1.0f);
    });
  });
  band.swap_values(next);

  RedistanceReport report;
  const Kernels& kernel = kernels();
  for (report.passes = 0; report.passes < kMaxPasses;) {
    const float change = parallel_reduce(
        band.brick_count(), 16, run, 0.0f,
        [&](std::size_t begin, std::size_t end) {
          float largest = 0;
          float halo[kHaloSize];
          for (std::size_t brick = begin; brick < end; ++brick) {
            gather_halo(band, band.values().data(), brick, background, -background, halo);
            largest = std::max(largest, kernel.eikonal(halo, voxel, background, next.data() + brick * Band::kBrickNodes));
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
