#include <meniscus/scene/identity.h>

#include <gtest/gtest.h>

namespace meniscus::scene {
namespace {

TEST(Identity, NumbersAreNeverUsedTwice) {
  Attributes a;
  std::int64_t next = 5;
  number(a, 0, 3, next);
  EXPECT_EQ(next, 8);
  number(a, 2, 4, next);  // the third was lost, two are new
  const auto ids = a.integers("id");
  EXPECT_EQ(std::vector<std::int64_t>(ids.begin(), ids.end()), (std::vector<std::int64_t>{5, 6, 8, 9}));
}

TEST(Identity, TopologyTellsATetrahedronFromTwo) {
  mesh::Mesh one{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}, {}};
  EXPECT_EQ(topology_of(one), (Topology{1, 2}));
  mesh::Mesh two = one;
  two.positions.insert(two.positions.end(), one.positions.begin(), one.positions.end());
  for (Triangle t : one.triangles) {
    for (std::int32_t& i : t) i += 4;
    two.triangles.push_back(t);
  }
  EXPECT_EQ(topology_of(two), (Topology{2, 4}));
}

}  // namespace
}  // namespace meniscus::scene
