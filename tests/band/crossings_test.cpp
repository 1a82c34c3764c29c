#include "support.h"

#include <meniscus/band/crossings.h>
#include <meniscus/band/kernels.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace meniscus::band {
namespace {

using test::ball;

const Vec3 kCenter(0.3, -0.2, 0.1);

TEST(Crossings, LieOnTheSurfaceBetweenTheirNodes) {
  const Band band = ball(1, kCenter, 12);
  const Crossings c = find_crossings(band);
  ASSERT_GT(c.size(), 2000u);
  EXPECT_EQ(c.brick_begin.back(), c.size());
  for (std::size_t i = 0; i < c.size(); ++i) {
    EXPECT_LT(band.values()[c.inside[i]], 0);
    EXPECT_GE(band.values()[c.outside[i]], 0);
    const Vec3 r = c.x.view()[i] - kCenter;
    EXPECT_NEAR(r.norm(), 12, 0.02);
    EXPECT_GT(c.normal[i].dot(r.normalized()), 0.995);
  }
}

TEST(Crossings, AreAsManyAsEdgesWithBothSides) {
  const Band band = ball(1, kCenter, 9);
  std::size_t edges = 0;
  for (std::size_t b = 0; b < band.brick_count(); ++b) {
    Halo halo;
    gather_halo(band, band.values().data(), b, band.background(), -band.background(), halo);
    for (int n = 0; n < 512; ++n)
      for (const int step : {kHaloX, kHaloY, 1}) {
        const float* p = halo + halo_at(n >> 6, n >> 3 & 7, n & 7);
        edges += (p[0] < 0) != (p[step] < 0);
      }
  }
  EXPECT_EQ(find_crossings(band).size(), edges);
}

TEST(Crossings, SpeedsAreCarriedAlongTheNormals) {
  const Band band = ball(1, kCenter, 14);
  const Crossings c = find_crossings(band);
  std::vector<double> speed(c.size());
  const auto truth = [](const Vec3& x) { return 1 + (x - kCenter).normalized().x(); };
  for (std::size_t i = 0; i < speed.size(); ++i) speed[i] = truth(c.x.view()[i]);
  const Outlines outlines = outlines_of(band);
  NodeSpeeds near, once;
  once.values.resize(band.values().size());
  once.any.assign(band.brick_count(), 1);
  near_speeds(band, c, speed, near);
  const auto pass = [&](const NodeSpeeds& from, std::size_t b) {
    Halo phi, v;
    gather_star(band, band.values().data(), b, band.background(), -band.background(), phi);
    extend_speeds(band, from, b, phi, layers_within(outlines[b], 8), v);
    return v;
  };
  for (std::size_t b = 0; b < band.brick_count(); ++b) kernels().centre(pass(near, b), once.values.data() + b * 512);
  double worst = 0, sum = 0;
  std::size_t beside = 0, counted = 0, within = 0, missing = 0;
  for (std::size_t b = 0; b < band.brick_count(); ++b) {
    const Halo v = pass(once, b);
    for (int n = 0; n < 512; ++n) {
      beside += near.any[b] != 0 && !std::isnan(near.values[b * 512 + static_cast<std::size_t>(n)]);
      const float f = band.values()[b * 512 + static_cast<std::size_t>(n)];
      if (std::abs(f) >= 2.5f) continue;
      ++within;
      const float got = v[halo_at(n >> 6, n >> 3 & 7, n & 7)];
      if (std::isnan(got)) {
        ASSERT_GT(std::abs(f), 2.0f);
        ++missing;
        continue;
      }
      const double off = std::abs(static_cast<double>(got) - truth(band.position(b, n >> 6, n >> 3 & 7, n & 7)));
      worst = std::max(worst, off);
      sum += off;
      ++counted;
    }
  }
  EXPECT_GT(beside, c.size() / 3);
  EXPECT_LE(missing * 1000, within);
  // The speed changes by 1/14 from voxel to voxel.
  EXPECT_LT(worst, 1.5 / 14);
  EXPECT_LT(sum / static_cast<double>(counted), 0.4 / 14);
}

}  // namespace
}  // namespace meniscus::band
