#include "support.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace meniscus::band {
namespace {

TEST(BandGrid, ThereAndBackAreTheSameBits) {
  const Band band = test::ball(0.1, {0.3, -0.2, 5}, 1);
  const field::Grid grid = band.grid();
  EXPECT_EQ(grid.voxel(), band.voxel());
  EXPECT_EQ(grid.origin(), band.origin());
  EXPECT_EQ(static_cast<float>(grid.background()), band.background());
  const Band again(grid);
  EXPECT_EQ(test::fingerprint(again), test::fingerprint(band));
  for (std::size_t b = 0; b < band.brick_count(); ++b) EXPECT_EQ(again.neighbours(b), band.neighbours(b));
  EXPECT_TRUE(Band(Band(0.1).grid()).empty());
}

TEST(BandGrid, TheBackgroundOfANarrowerGridMeansAtLeastThatFar) {
  const Band band = test::ball(0.1, {0, 0, 0}, 1);
  const float narrow = 2 * static_cast<float>(band.voxel());
  std::vector<float> values(band.values().begin(), band.values().end());
  for (float& v : values) v = std::clamp(v, -narrow, narrow);
  const Band wide(field::Grid(band.voxel(), band.origin(), static_cast<double>(narrow), band.bricks(), values));
  ASSERT_EQ(wide.values().size(), values.size());
  for (std::size_t n = 0; n < values.size(); ++n)
    EXPECT_EQ(wide.values()[n], std::abs(values[n]) < narrow ? values[n] : std::copysign(band.background(), values[n]));
  EXPECT_NEAR(test::total_volume(wide), test::total_volume(band), 1e-9);
}

}  // namespace
}  // namespace meniscus::band
