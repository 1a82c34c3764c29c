#include <meniscus/mesh/adjacency.h>

#include <gtest/gtest.h>

#include <algorithm>

namespace meniscus::mesh {
namespace {

std::vector<std::int32_t> list(std::span<const std::int32_t> s) { return {s.begin(), s.end()}; }

/// Two triangles that share the edge 1 2, and a vertex that none uses.
Mesh kite() {
  Mesh m;
  m.positions.assign(5, Vec3::Zero());
  m.triangles = {{0, 1, 2}, {2, 1, 3}};
  return m;
}

TEST(Adjacency, TrianglesOfVertices) {
  const IndexLists t = vertex_triangles(kite());
  ASSERT_EQ(t.size(), 5U);
  EXPECT_EQ(list(t[0]), (std::vector<std::int32_t>{0}));
  EXPECT_EQ(list(t[1]), (std::vector<std::int32_t>{0, 1}));
  EXPECT_EQ(list(t[3]), (std::vector<std::int32_t>{1}));
  EXPECT_TRUE(t[4].empty());
}

TEST(Adjacency, NeighboursRiseAndOccurOnce) {
  const IndexLists n = vertex_neighbours(kite());
  EXPECT_EQ(list(n[0]), (std::vector<std::int32_t>{1, 2}));
  EXPECT_EQ(list(n[1]), (std::vector<std::int32_t>{0, 2, 3}));
  EXPECT_EQ(list(n[2]), (std::vector<std::int32_t>{0, 1, 3}));
  EXPECT_TRUE(n[4].empty());
}

TEST(Adjacency, EdgesKnowTheirDirections) {
  const std::vector<Edge> e = edges(kite());
  ASSERT_EQ(e.size(), 5U);
  EXPECT_TRUE(
      std::is_sorted(e.begin(), e.end(), [](auto& p, auto& q) { return std::pair(p.a, p.b) < std::pair(q.a, q.b); }));
  const auto shared = std::find_if(e.begin(), e.end(), [](auto& x) { return x.a == 1 && x.b == 2; });
  ASSERT_NE(shared, e.end());
  EXPECT_EQ(shared->forward, 1);
  EXPECT_EQ(shared->backward, 1);
  EXPECT_EQ(e[1].a, 0);  // 0 2, run as 2 -> 0
  EXPECT_EQ(e[1].backward, 1);
}

TEST(Adjacency, EmptyMesh) {
  EXPECT_EQ(vertex_triangles({}).size(), 0U);
  EXPECT_TRUE(edges({}).empty());
}

}  // namespace
}  // namespace meniscus::mesh
