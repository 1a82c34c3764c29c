#include "support.h"

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::band {
namespace {

TEST(BandOf, UnitedShapesAreAllThere) {
  Band band = test::ball(0.5, {0, 0, 0}, 3);
  band.unite(test::ball(0.5, {40, 0, 0}, 1.5));
  const auto parts = measure_components(band, label_components(band));
  ASSERT_EQ(parts.size(), 2u);
}

TEST(BandOf, AGridAndBackChangesNoSample) {
  const Band band = test::ball(0.5, {0.1, 0.2, 0.3}, 6);
  const Band back(band.grid());
  ASSERT_EQ(back.bricks(), band.bricks());
  EXPECT_EQ(test::fingerprint(back), test::fingerprint(band));
}

TEST(BandOf, ScalesWithTheShape) {
  const Band one = test::ball(1, {0.3, 0.2, 0.1}, 10);
  for (const double s : {0.01, 1000.0}) {
    const Band other = test::ball(s, Vec3(0.3, 0.2, 0.1) * s, 10 * s);
    ASSERT_EQ(other.bricks(), one.bricks());
    for (std::size_t n = 0; n < one.values().size(); ++n)
      ASSERT_NEAR(static_cast<double>(other.values()[n]) / s, static_cast<double>(one.values()[n]), 1e-3);
  }
}

}  // namespace
}  // namespace meniscus::band
