#include "support.h"

#include <meniscus/band/outline.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace meniscus::band {
namespace {

using test::ball;

TEST(Outline, TellsSidesAndHowNearRowsCome) {
  for (const double scale : {1.0, 0.01, 1000.0}) {
    const Band band = ball(scale, Vec3(0.3, 0.2, 0.1) * scale, 10 * scale);
    const Outlines outlines = outlines_of(band);
    ASSERT_EQ(outlines.size(), band.brick_count());
    for (std::size_t b = 0; b < band.brick_count(); ++b)
      for (std::size_t row = 0; row < 64; ++row) {
        double nearest = Band::kHalfWidth;
        for (std::size_t n = 8 * row; n < 8 * row + 8; ++n) {
          const float f = band.values()[b * 512 + n];
          ASSERT_EQ(outlines[b].inside[n / 64] >> n % 64 & 1, f < 0 ? 1u : 0u);
          nearest = std::min(nearest, std::abs(static_cast<double>(f)) / scale);
        }
        const double told = outlines[b].nearest[row] / static_cast<double>(Outline::kSteps);
        ASSERT_LE(told, nearest * (1 + 1e-6));
        ASSERT_GT(told + 1.0 / Outline::kSteps, nearest * (1 - 1e-6));
      }
  }
}

TEST(Outline, LayersHoldTheRowsThatComeNear) {
  const Band band = ball(1, {0.3, 0.2, 0.1}, 10);
  const Outlines outlines = outlines_of(band);
  std::size_t held = 0;
  for (const double limit : {0.7, 1.5, 2.5, 3.5, 8.0})
    for (const Outline& o : outlines) {
      const RowLayers layers = layers_within(o, limit);
      int rows = 0;
      for (const Rows l : layers) rows += std::popcount(l);
      ASSERT_EQ(rows, std::popcount(layers[0] | layers[1] | layers[2] | layers[3]));  // none twice
      ASSERT_EQ(rows, std::popcount(rows_within(o, limit)));
      for (std::size_t row = 0; row < 64; ++row) {
        const double near = o.nearest[row] / static_cast<double>(Outline::kSteps);
        const std::size_t layer = std::min<std::size_t>(3, static_cast<std::size_t>(near));
        const bool in = near < std::ceil(limit * Outline::kSteps) / Outline::kSteps;
        ASSERT_EQ(layers[layer] >> row & 1, in ? 1u : 0u);
        held += in;
      }
    }
  EXPECT_GT(held, 1000u);
}

TEST(Outline, SurfaceBricksHoldOrBorderOnBothSides) {
  const Band band = ball(1, {0.3, 0.2, 0.1}, 10);
  const std::vector<char> near = surface_bricks(band, outlines_of(band), {});
  for (std::size_t b = 0; b < band.brick_count(); ++b) {
    Halo halo;
    gather_halo(band, band.values().data(), b, band.background(), -band.background(), halo);
    bool in = false, out = false;
    for (int n = 0; n < 1000; ++n) {
      const bool inside = halo[halo_at(n / 100 - 1, n / 10 % 10 - 1, n % 10 - 1)] < 0;
      (inside ? in : out) = true;
    }
    if (in && out) ASSERT_NE(near[b], 0);
  }
  EXPECT_GT(std::count(near.begin(), near.end(), 1), 8);
}

}  // namespace
}  // namespace meniscus::band
