#include <meniscus/base/disjoint_sets.h>

#include <gtest/gtest.h>

namespace meniscus {
namespace {

TEST(DisjointSets, TheSmallestMemberNamesASetWhateverTheOrderOfJoins) {
  DisjointSets forward(6), backward(6);
  forward.join(1, 3), forward.join(3, 5);
  backward.join(5, 3), backward.join(3, 1);
  for (const std::uint32_t i : {1u, 3u, 5u}) {
    EXPECT_EQ(forward.root(i), 1u);
    EXPECT_EQ(backward.root(i), 1u);
  }
  for (const std::uint32_t i : {0u, 2u, 4u}) EXPECT_EQ(forward.root(i), i);
}

}  // namespace
}  // namespace meniscus
