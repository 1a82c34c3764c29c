#include <meniscus/base/suggest.h>

#include <gtest/gtest.h>

namespace meniscus {
namespace {

constexpr std::string_view kWords[] = {"radius", "center", "weight", "transform"};

TEST(Suggest, FindsTheSlip) {
  EXPECT_EQ(nearest_word("raduis", kWords), "radius");
  EXPECT_EQ(nearest_word("Center", kWords), "center");
  EXPECT_EQ(nearest_word("trasform", kWords), "transform");
  EXPECT_EQ(did_you_mean("wieght", kWords), " (did you mean 'weight'?)");
}

TEST(Suggest, SaysNothingAboutStrangers) {
  EXPECT_EQ(nearest_word("banana", kWords), "");
  EXPECT_EQ(did_you_mean(std::string(1000, 'x'), kWords), "");
}

}  // namespace
}  // namespace meniscus
