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
  for (std::size_t n = 0; n < labels.node.size(); ++n) EXPECT_TRUE(labels.node[n] < 0 || band.values()[n] < 0);
}

Component part(double volume, double area, std::optional<double> goal) { return {volume, area, goal}; }

TEST(Components, GoalsAddUpInAMerge) {
  const Labels before{{0, 0, 1, -1}, 2}, now{{0, 0, 0, 0}, 1};
  std::vector<Component> fresh = {part(29, 10, {})};
  inherit_goals(before, {part(10, 5, 11), part(20, 5, 19)}, now, fresh);
  ASSERT_TRUE(fresh[0].goal);
  EXPECT_DOUBLE_EQ(*fresh[0].goal, 30);
}

TEST(Components, ASplitSharesWhatIsMissingByArea) {
  const Labels before{{0, 0, 0, 0}, 1}, now{{0, -1, 1, 1}, 2};
  std::vector<Component> fresh = {part(10, 1, {}), part(16, 3, {})};
  inherit_goals(before, {part(26, 4, 30)}, now, fresh);
  ASSERT_TRUE(fresh[0].goal && fresh[1].goal);
  EXPECT_DOUBLE_EQ(*fresh[0].goal, 11);
  EXPECT_DOUBLE_EQ(*fresh[1].goal, 19);
}

TEST(Components, APartOutOfNowhereHasNoGoal) {
  const Labels before{{0, -1}, 1}, now{{0, 1}, 2};
  std::vector<Component> fresh = {part(4, 1, {}), part(5, 1, {})};
  inherit_goals(before, {part(4, 1, 4)}, now, fresh);
  EXPECT_TRUE(fresh[0].goal);
  EXPECT_FALSE(fresh[1].goal);
}

}  // namespace
}  // namespace meniscus::band
