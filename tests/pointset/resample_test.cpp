#include <meniscus/pointset/resample.h>

#include <meniscus/pointset/local_fit.h>

#include "clouds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>

namespace meniscus::pointset {
namespace {

std::vector<std::uint32_t> all(const PointSet& set) {
  std::vector<std::uint32_t> indices(set.size());
  std::iota(indices.begin(), indices.end(), 0U);
  return indices;
}

PointSet without(points::Cloud cloud, const std::function<bool(const Vec3&)>& hole) {
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < cloud.size(); ++i)
    if (!hole(cloud.positions[i])) kept.push_back(i);
  return fit(points::gathered(cloud, kept));
}

TEST(Gaps, AreFoundInHolesAndNowhereElse) {
  for (const double scale : {0.01, 1.0, 1000.0}) {
    const double spacing = scale * std::sqrt(4 * std::numbers::pi / 2000);
    const PointSet set =
        without(test::sphere(2000, scale), [&](const Vec3& p) { return (p - Vec3(scale, 0, 0)).norm() < 1.3 * spacing; });
    const auto gaps = find_gaps(set, points::NeighbourSearch(positions(set)), all(set), spacing);
    EXPECT_GE(gaps.size(), 1u);
    for (const Gap& g : gaps) {
      EXPECT_LT((g.place - Vec3(scale, 0, 0)).norm(), 1.6 * spacing);
      for (std::size_t i = 0; i < set.size(); ++i) EXPECT_GT((g.place - set.position(i)).norm(), 0.75 * spacing);
    }
  }
}

TEST(Gaps, DoNotLieBeyondAnOpenBorder) {
  const PointSet set = without(test::sphere(2000), [](const Vec3& p) { return p.z() < 0.1; });
  const double spacing = std::sqrt(4 * std::numbers::pi / 2000);
  const auto gaps = find_gaps(set, points::NeighbourSearch(positions(set)), all(set), spacing);
  for (const Gap& g : gaps) EXPECT_GT(g.place.z(), 0.1 - 0.5 * spacing);
}

TEST(Gaps, AreNotSeenAcrossAThinPlate) {
  // A hole in the upper sheet only; the lower sheet, nearer than the spacing, does not close it.
  const double spacing = 0.05;
  const PointSet set =
      without(test::plate(1, 0.04, spacing), [&](const Vec3& p) { return p.z() > 0 && p.head<2>().norm() < 1.5 * spacing; });
  const auto gaps = find_gaps(set, points::NeighbourSearch(positions(set)), all(set), spacing);
  const bool found = std::any_of(gaps.begin(), gaps.end(),
                                 [](const Gap& g) { return g.place.z() > 0.01 && g.place.head<2>().norm() < 0.075; });
  EXPECT_TRUE(found);
}

TEST(Crowded, PointsGoUntilNoneIsNear) {
  const PointSet set = fit(test::sphere(2000));
  const double spacing = 3 * std::sqrt(4 * std::numbers::pi / 2000);
  const points::NeighbourSearch search(positions(set));
  const auto crowded = find_crowded(set, search, all(set), spacing);
  std::vector<char> gone(set.size(), 0);
  for (const std::uint32_t i : crowded) gone[i] = 1;
  std::vector<points::Neighbour> near;
  std::size_t left = 0;
  for (std::uint32_t i = 0; i < set.size(); ++i) {
    if (gone[i]) continue;
    ++left;
    search.within(set.position(i), 0.62 * spacing, near);
    for (const points::Neighbour& n : near) EXPECT_TRUE(n.index == i || gone[n.index]);
  }
  EXPECT_GT(left, 400u);  // as many as discs of 0.62 spacings leave room for, packed at random
  EXPECT_TRUE(find_crowded(set, search, all(set), spacing / 6).empty());
}

TEST(Crowded, SheetsOfAThinPlateDoNotCrowd) {
  const PointSet set = fit(test::plate(1, 0.01, 0.05));
  const points::NeighbourSearch search(positions(set));
  for (const std::uint32_t i : find_crowded(set, search, all(set), 0.035))
    EXPECT_GT(set.position(i).head<2>().cwiseAbs().maxCoeff(), 0.4);  // the rim only
}

}  // namespace
}  // namespace meniscus::pointset
