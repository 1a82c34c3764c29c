#include "support.h"

#include <meniscus/band/redistance.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace meniscus::band {
namespace {

using test::ball;

double worst_error(const Band& band, double radius, double within) {
  double worst = 0;
  for (std::size_t b = 0; b < band.brick_count(); ++b)
    for (int n = 0; n < 512; ++n) {
      const double d = band.position(b, n >> 6, n >> 3 & 7, n & 7).norm() - radius;
      if (std::abs(d) < within)
        worst = std::max(worst, std::abs(static_cast<double>(band.values()[b * 512 + static_cast<std::size_t>(n)]) - d));
    }
  return worst;
}

TEST(Redistancing, LeavesDistancesAlone) {
  Band band = ball(1, Vec3::Zero(), 16);
  std::vector<float> exact(band.values().size());
  for (std::size_t b = 0; b < band.brick_count(); ++b)
    for (int n = 0; n < 512; ++n)
      exact[b * 512 + static_cast<std::size_t>(n)] = static_cast<float>(std::clamp<double>(
          band.position(b, n >> 6, n >> 3 & 7, n & 7).norm() - 16, -band.background(), band.background()));
  band.swap_values(exact);
  redistance(band);
  EXPECT_LT(worst_error(band, 16, 3.9), 0.02);
}

TEST(Redistancing, FindsDistancesFromWhatIsNearTheSurface) {
  // Everything beyond two voxels is forgotten.
  Band band = ball(1, Vec3::Zero(), 16);
  std::vector<float> flat(band.values().begin(), band.values().end());
  for (float& f : flat)
    if (std::abs(f) > 2) f = std::copysign(band.background(), f);
  band.swap_values(flat);
  const RedistanceReport r = redistance(band);
  EXPECT_LT(r.last_change, 1e-4);
  EXPECT_LT(worst_error(band, 16, 3.9), 0.1);
}

TEST(Redistancing, DistancesFollowWhatIsNextToTheSurface) {
  // Nodes next to the surface have moved on by 0.3 voxel, the others have not.
  Band band = ball(1, Vec3::Zero(), 16);
  std::vector<float> moved(band.values().begin(), band.values().end()), room;
  for (float& f : moved)
    if (std::abs(f) < 1.5f) f -= 0.3f;
  band.swap_values(moved);
  Outlines outlines = outlines_of(band);
  spread_distances(band, outlines, 2.5, room, {});
  EXPECT_LT(worst_error(band, 16.3, 1), 0.05);
  spread_distances(band, outlines, 2.5, room, {});  // what was beyond a brick's border is one pass late
  EXPECT_LT(worst_error(band, 16.3, 2), 0.05);
  EXPECT_GT(worst_error(band, 16.3, 3.6), 0.2);  // beyond its reach nothing has changed
  for (int pass = 0; pass < 4; ++pass) spread_distances(band, outlines, Band::kHalfWidth, room, {});
  EXPECT_LT(worst_error(band, 16.3, 3.6), 0.06);
  const Outlines fresh = outlines_of(band);
  for (std::size_t b = 0; b < fresh.size(); ++b) {
    EXPECT_EQ(outlines[b].inside, fresh[b].inside);
    EXPECT_EQ(outlines[b].nearest, fresh[b].nearest);
  }
}

TEST(Redistancing, StopsWhenToldTo) {
  Band band = ball(1, Vec3::Zero(), 10);
  std::vector<float> twice(band.values().begin(), band.values().end());
  for (float& f : twice) f = std::clamp(2 * f, -band.background(), band.background());
  band.swap_values(twice);
  EXPECT_EQ(redistance(band, {}, 1).passes, 1);
}

}  // namespace
}  // namespace meniscus::band
