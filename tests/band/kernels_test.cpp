#include "support.h"

#include <meniscus/band/kernels.h>

#include <gtest/gtest.h>

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

TEST(Halos, HoldWhatStencilsOfSomeRowsRead) {
  const Band band = ball(1, {0.3, 0.2, 0.1}, 10);
  const float bg = band.background();
  for (std::size_t b = 0; b < band.brick_count(); ++b) {
    const Rows rows = 0x8100'0042'1800'0081ull << (b % 8);
    Halo all, some, star;
    gather_halo(band, band.values().data(), b, bg, -bg, all);
    gather_halo(band, band.values().data(), b, bg, -bg, some, rows);
    gather_star(band, band.values().data(), b, bg, -bg, star, rows);
    for (int row = 0; row < 64; ++row)
      for (int k = 0; k < 8; ++k) {
        const int i = row >> 3, j = row & 7;
        ASSERT_EQ(some[halo_at(i, j, k)], all[halo_at(i, j, k)]);
        if ((rows >> row & 1) == 0) continue;
        for (int d = -2; d <= 2; ++d)
          for (const int at : {halo_at(i + d, j, k), halo_at(i, j + d, k), halo_at(i, j, k + d)}) {
            ASSERT_EQ(some[at], all[at]);
            ASSERT_EQ(star[at], all[at]);
          }
        for (int d = 0; d < 27; ++d) {
          const int at = halo_at(i + d / 9 - 1, j + d / 3 % 3 - 1, k + d % 3 - 1);
          ASSERT_EQ(some[at], all[at]);
        }
      }
  }
}

TEST(NearRows, HoldOrBorderOnNearNodes) {
  const Band band = ball(1, {0.3, 0.2, 0.1}, 10);
  for (const float limit : {1.0f, 2.5f, band.background()}) {
    const NearRows near(band, limit, {});
    for (std::size_t b = 0; b < band.brick_count(); ++b) {
      Halo halo;
      gather_halo(band, band.values().data(), b, band.background(), -band.background(), halo);
      for (int row = 0; row < 64; ++row) {
        bool any = false;
        for (int k = 0; k < 8; ++k)
          for (const int step : {0, kHaloX, -kHaloX, kHaloY, -kHaloY, 1, -1})
            any = any || std::abs(halo[halo_at(row >> 3, row & 7, k) + step]) < limit;
        ASSERT_EQ(near.of(b) >> row & 1, any ? 1u : 0u);
      }
    }
  }
}

TEST(Halos, BitsTellSidesAndDistance) {
  const Band band = ball(1, {0.3, 0.2, 0.1}, 10);
  for (std::size_t b = 0; b < band.brick_count(); ++b) {
    const float* f = band.values().data() + b * 512;
    NodeBits inside, nearer;
    kernels().inside(f, inside);
    kernels().nearer(f, 1.5f, nearer);
    for (std::size_t n = 0; n < 512; ++n) {
      ASSERT_EQ(inside[n / 64] >> n % 64 & 1, f[n] < 0 ? 1u : 0u);
      ASSERT_EQ(nearer[n / 64] >> n % 64 & 1, std::abs(f[n]) < 1.5f ? 1u : 0u);
    }
  }
}

TEST(Kernels, SameBitsOnEveryProcessor) {
  const Band band = ball(1, {0.3, 0.2, 0.1}, 10);
  const float bg = band.background();
  for (std::size_t b = 0; b < band.brick_count(); ++b) {
    std::vector<float> out[2];
    for (const Kernels* set : {&kernels(), &baseline_kernels()}) {
      std::vector<float>& all = out[set == &kernels() ? 0 : 1];
      const auto take = [&](const Halo& halo) {
        all.resize(all.size() + 512);
        set->centre(halo, all.data() + all.size() - 512);
      };
      Halo halo, speed;
      gather_halo(band, band.values().data(), b, bg, -bg, halo);
      for (int n = 0; n < kHaloSize; ++n)
        speed[n] = std::abs(halo[n]) < 1 ? std::sin(static_cast<float>(n)) : std::numeric_limits<float>::quiet_NaN();
      set->extend(halo, speed, bg, kAllRows);
      take(speed);
      std::vector<float> rescaled(512);
      set->rescale(halo, 1, rescaled.data());
      all.insert(all.end(), rescaled.begin(), rescaled.end());
      std::uint16_t cells[512];
      SurfacePart part;
      set->surface_part(halo, 1, cells, set->cut_cells(halo, cells), part);
      all.insert(all.end(), {part.area, part.flux, part.normal[0], part.normal[1], part.normal[2]});
      for (int n = 0; n < kHaloSize; ++n) halo[n] *= 1.1f;
      all.push_back(set->eikonal(halo, 1, bg, kAllRows));
      take(halo);
    }
    ASSERT_EQ(out[0].size(), out[1].size());
    ASSERT_EQ(std::memcmp(out[0].data(), out[1].data(), out[0].size() * sizeof(float)), 0);
  }
}

}  // namespace
}  // namespace meniscus::band
