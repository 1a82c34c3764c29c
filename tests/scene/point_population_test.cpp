#include <meniscus/field/combine.h>
#include <meniscus/field/primitives.h>
#include <meniscus/points/neighbours.h>
#include <meniscus/polygonize/polygonize.h>
#include <meniscus/scene/point_population.h>

#include <gtest/gtest.h>

#include <algorithm>

namespace meniscus::scene {
namespace {

constexpr double kSpacing = 0.15;

std::unique_ptr<field::Field> balls(const std::vector<double>& places) {
  std::vector<std::unique_ptr<field::Field>> parts;
  for (const double x : places) parts.push_back(field::sphere({x, 0.0, 0.0}, 1.0));
  return field::set_union(std::move(parts));
}

double largest_gap(const points::Cloud& cloud, const field::Field& f) {
  const points::NeighbourSearch search(cloud.positions);
  std::vector<points::Neighbour> found;
  double gap = 0;
  for (const Vec3& p : polygonize::polygonize(f, {.voxel = kSpacing / 2}).mesh.positions) {
    search.nearest(p, 1, found);
    gap = std::max(gap, std::sqrt(found.at(0).squared_distance));
  }
  return gap;
}

points::Cloud numbered(points::Cloud cloud) {
  std::vector<std::int64_t> ids(cloud.size());
  for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<std::int64_t>(i);
  cloud.attributes.set_integers("id", 1, std::move(ids));
  return cloud;
}

TEST(PointPopulation, CoversWhatOpensUp) {
  const auto one = balls({0});
  const auto two = balls({0, 3});
  points::Cloud cloud = numbered(PointPopulation(*one, kSpacing).first({}));
  const std::vector<Vec3> before = cloud.positions;
  const auto probes = polygonize::polygonize(*two, {.voxel = kSpacing, .projection = 0}).mesh.positions;
  PointPopulation(*two, kSpacing).cover(cloud, probes, {});
  ASSERT_GT(cloud.size(), before.size() * 3 / 2);
  EXPECT_TRUE(std::equal(before.begin(), before.end(), cloud.positions.begin()));
  EXPECT_EQ(cloud.attributes.integers("id").size(), cloud.size());
  for (std::size_t i = before.size(); i < cloud.size(); ++i) {
    EXPECT_GT(cloud.positions[i].x(), 1.9);
    EXPECT_NEAR((cloud.positions[i] - Vec3(3, 0, 0)).norm(), 1, 1e-12);
  }
  EXPECT_LT(largest_gap(cloud, *two), 2 * kSpacing);
  const std::size_t size = cloud.size();
  PointPopulation(*two, kSpacing).cover(cloud, probes, {});
  EXPECT_EQ(cloud.size(), size) << "what is covered gets no more points";
}

TEST(PointPopulation, RedistributionEvensOutAndKeepsIdentities) {
  const auto f = balls({0});
  const PointPopulation population(*f, kSpacing);
  points::Cloud cloud = numbered(population.first({}));
  const std::size_t whole = cloud.size();
  // Crowded towards one side, bare on the other.
  for (Vec3& p : cloud.positions) p = (p + Vec3(0.8, 0, 0)).normalized();
  const double before = largest_gap(cloud, *f);
  const std::size_t kept = population.redistribute(cloud, {});
  EXPECT_GT(before, 1.5 * kSpacing);
  EXPECT_LT(largest_gap(cloud, *f), 0.75 * before);
  EXPECT_GT(kept, whole / 2);
  EXPECT_LE(kept, cloud.size());
  const auto ids = cloud.attributes.integers("id");
  ASSERT_EQ(ids.size(), cloud.size());
  for (std::size_t i = 1; i < kept; ++i) EXPECT_LT(ids[i - 1], ids[i]);
  for (const Vec3& p : cloud.positions) EXPECT_NEAR(p.norm(), 1, 1e-12);
}

TEST(PointPopulation, AnEmptySurfaceHasNoPoints) {
  const auto f = balls({0});
  points::Cloud none;
  EXPECT_EQ(PointPopulation(*f, kSpacing).redistribute(none, {}), 0u);
  PointPopulation(*f, kSpacing).cover(none, std::vector<Vec3>{{1, 0, 0}}, {});
  EXPECT_EQ(none.size(), 1u);
}

}  // namespace
}  // namespace meniscus::scene
