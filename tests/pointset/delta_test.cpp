#include <meniscus/pointset/delta.h>

#include <meniscus/pointset/local_fit.h>

#include "clouds.h"

#include <gtest/gtest.h>

namespace meniscus::pointset {
namespace {

void expect_same(const PointSet& a, const PointSet& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a.position(i), b.position(i));
    EXPECT_EQ(a.normal(i), b.normal(i));
    EXPECT_EQ(a.border(i), b.border(i));
    EXPECT_EQ(a.reach[i], b.reach[i]);
  }
  EXPECT_EQ(a.coefficients, b.coefficients);
  const auto ia = a.attributes.integers(attribute::kId), ib = b.attributes.integers(attribute::kId);
  EXPECT_EQ(std::vector<std::int64_t>(ia.begin(), ia.end()), std::vector<std::int64_t>(ib.begin(), ib.end()));
}

TEST(Delta, GoesThereAndBackToTheBit) {
  points::Cloud cloud = test::sphere(200);
  std::vector<std::int64_t> ids;
  for (std::int64_t i = 0; i < 200; ++i) ids.push_back(i);
  cloud.attributes.set_integers(attribute::kId, 1, ids);
  const PointSet before = fit(cloud);

  // Numbers 0, 7 and 199 go, 50 and 60 change, two come.
  PointSet after = before;
  after.x[50] += 1e-3;
  after.coefficients_of(60)[5] = -0.0;
  std::vector<std::size_t> kept;
  std::vector<std::uint32_t> origin;
  for (std::uint32_t i = 0; i < 200; ++i)
    if (i != 0 && i != 7 && i != 199) kept.push_back(i), origin.push_back(i);
  after.keep(kept);
  const PointRecord fresh[2] = {before.record(3), before.record(4)};
  const std::size_t like[2] = {3, 4};
  after.append(fresh, like);

  const Delta delta(before, after, origin);
  EXPECT_EQ(delta.changed(), 2u);
  EXPECT_EQ(delta.removed(), 3u);
  EXPECT_EQ(delta.added(), 2u);
  PointSet set = before;
  for (int round = 0; round < 2; ++round) {
    delta.redo(set);
    expect_same(set, after);
    delta.undo(set);
    expect_same(set, before);
  }
}

TEST(Delta, OfNothingIsEmpty) {
  const PointSet set = fit(test::sphere(50));
  std::vector<std::uint32_t> origin(50);
  for (std::uint32_t i = 0; i < 50; ++i) origin[i] = i;
  EXPECT_TRUE(Delta(set, set, origin).empty());
}

}  // namespace
}  // namespace meniscus::pointset
