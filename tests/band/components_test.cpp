#include "support.h"

#include <meniscus/band/components.h>

#include <gtest/gtest.h>

namespace meniscus::band {
namespace {

using test::ball;

TEST(Components, AreToldApartAndMeasured) {
  Band band = ball(1, {-12, 0, 0}, 8);
  band.unite(ball(1, {12, 0, 0}, 5));
  const Labels labels = label_components(band);
  const auto parts = measure_components(band, labels);
  ASSERT_EQ(parts.size(), 2u);
  // Flat pieces between crossings lie inside the ball, by 1/(6 R) in the mean.
  EXPECT_NEAR(test::radius_of(parts[0].volume), 8 - 1.0 / 48, 0.005);
  EXPECT_NEAR(test::radius_of(parts[1].volume), 5 - 1.0 / 30, 0.005);
  for (std::size_t n = 0; n < band.values().size(); ++n) {
    const float f = band.values()[n];
    const std::int32_t label = labels.of(n / 512, n % 512);
    ASSERT_EQ(label >= 0, f < 0 && f > -band.background());
    if (label >= 0) ASSERT_EQ(label, band.position(n / 512, static_cast<int>(n >> 6 & 7), 0, 0).x() < 0 ? 0 : 1);
  }
}

TEST(Components, AreToldApartWithinABrick) {
  Band band = ball(1, {0.8, 3.5, 3.5}, 1.9);
  band.unite(ball(1, {6.6, 3.5, 3.5}, 2.3));
  const Labels labels = label_components(band);
  const auto parts = measure_components(band, labels);
  ASSERT_EQ(parts.size(), 2u);
  const std::int32_t brick = band.find({0, 0, 0});
  ASSERT_GE(brick, 0);
  EXPECT_EQ(labels.begin[static_cast<std::size_t>(brick) + 1] - labels.begin[static_cast<std::size_t>(brick)], 2u);
  EXPECT_NEAR(test::radius_of(parts[0].volume), 1.9 - 1 / (6 * 1.9), 0.03);
  EXPECT_NEAR(test::radius_of(parts[1].volume), 2.3 - 1 / (6 * 2.3), 0.03);
  EXPECT_NEAR(parts[0].area, 4 * std::numbers::pi * 1.9 * 1.9, 0.12 * parts[0].area);
}

/// Labels of the first nodes of a single brick.
Labels labels_of(const std::vector<std::int32_t>& node, std::size_t count) {
  Labels out{{}, {0, 0}, count};
  for (std::size_t n = 0; n < node.size(); ++n)
    if (node[n] >= 0) out.pieces.push_back({{std::uint64_t{1} << n}, node[n]});
  out.begin[1] = out.pieces.size();
  return out;
}

Component part(double volume, double area, std::optional<double> goal) { return {volume, area, goal}; }

TEST(Components, GoalsAddUpInAMerge) {
  const Labels before = labels_of({0, 0, 1, -1}, 2), now = labels_of({0, 0, 0, 0}, 1);
  std::vector<Component> fresh = {part(29, 10, {})};
  inherit_goals(before, {part(10, 5, 11), part(20, 5, 19)}, now, fresh);
  ASSERT_TRUE(fresh[0].goal);
  EXPECT_DOUBLE_EQ(*fresh[0].goal, 30);
}

TEST(Components, ASplitSharesWhatIsMissingByArea) {
  const Labels before = labels_of({0, 0, 0, 0}, 1), now = labels_of({0, -1, 1, 1}, 2);
  std::vector<Component> fresh = {part(10, 1, {}), part(16, 3, {})};
  inherit_goals(before, {part(26, 4, 30)}, now, fresh);
  ASSERT_TRUE(fresh[0].goal && fresh[1].goal);
  EXPECT_DOUBLE_EQ(*fresh[0].goal, 11);
  EXPECT_DOUBLE_EQ(*fresh[1].goal, 19);
}

TEST(Components, APartOutOfNowhereHasNoGoal) {
  const Labels before = labels_of({0, -1}, 1), now = labels_of({0, 1}, 2);
  std::vector<Component> fresh = {part(4, 1, {}), part(5, 1, {})};
  inherit_goals(before, {part(4, 1, 4)}, now, fresh);
  EXPECT_TRUE(fresh[0].goal);
  EXPECT_FALSE(fresh[1].goal);
}

}  // namespace
}  // namespace meniscus::band
