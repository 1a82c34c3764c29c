#include "support.h"

#include <meniscus/band/kernels.h>
#include <meniscus/band/outline.h>

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace meniscus::band {
namespace {

using test::ball;

TEST(Halos, HoldWhatIsAround) {
  const Band band = ball(1, {0.3, 0.2, 0.1}, 10);
  for (std::size_t b = 0; b < band.brick_count(); ++b) {
    Halo full, star;
    gather_halo(band, band.values().data(), b, band.background(), -band.background(), full);
    gather_star(band, band.values().data(), b, band.background(), -band.background(), star);
    for (int i = -2; i < 10; ++i)
      for (int j = -2; j < 10; ++j)
        for (int k = -2; k < 10; ++k) {
          ASSERT_EQ(full[halo_at(i, j, k)], static_cast<float>(band.sample(band.position(b, i, j, k))));
          const int beyond = (i < 0 || i > 7) + (j < 0 || j > 7) + (k < 0 || k > 7);
          if (beyond <= 1) ASSERT_EQ(star[halo_at(i, j, k)], full[halo_at(i, j, k)]);
        }
  }
}

TEST(Kernels, SameBitsOnEveryProcessor) {
  const Band band = ball(1, {0.3, 0.2, 0.1}, 10);
  const float bg = band.background();
  const Outlines outlines = outlines_of(band);
  for (std::size_t b = 0; b < band.brick_count(); ++b) {
    std::vector<float> out[2];
    for (const Kernels* set : {&kernels(), &baseline_kernels()}) {
      std::vector<float>& all = out[set == &kernels() ? 0 : 1];
      const auto take = [&](const Halo& halo) {
        all.resize(all.size() + 512);
        set->centre(halo, all.data() + all.size() - 512);
      };
      Outline outline;
      set->outline(band.values().data() + b * 512, 1, outline);
      for (const std::uint64_t plane : outline.inside)
        all.push_back(std::bit_cast<float>(static_cast<std::uint32_t>(plane ^ plane >> 32)));
      all.insert(all.end(), outline.nearest.begin(), outline.nearest.end());
      Halo halo, speed;
      gather_halo(band, band.values().data(), b, bg, -bg, halo);
      for (int n = 0; n < kHaloSize; ++n)
        speed[n] = std::abs(halo[n]) < 1 ? std::sin(static_cast<float>(n)) : std::numeric_limits<float>::quiet_NaN();
      const RowLayers rows = layers_within(outlines[b], 3.5);
      set->extend(halo, speed, rows);
      take(speed);
      std::vector<float> rescaled(512);
      set->rescale(halo, 1, rescaled.data());
      all.insert(all.end(), rescaled.begin(), rescaled.end());
      std::uint16_t cells[512];
      SurfacePart part;
      set->surface_part(halo, 1, cells, set->cut_cells(halo, cells), part);
      all.insert(all.end(), {part.area, part.flux, part.normal[0], part.normal[1], part.normal[2]});
      for (int n = 0; n < kHaloSize; ++n) halo[n] *= 1.1f;
      all.push_back(set->eikonal(halo, 1, bg, rows));
      take(halo);
    }
    ASSERT_EQ(out[0].size(), out[1].size());
    ASSERT_EQ(std::memcmp(out[0].data(), out[1].data(), out[0].size() * sizeof(float)), 0);
  }
}

}  // namespace
}  // namespace meniscus::band
