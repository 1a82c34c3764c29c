#include <meniscus/mesh/components.h>

#include <gtest/gtest.h>

namespace meniscus::mesh {
namespace {

TEST(Components, AreNumberedByTheirLowestVertex) {
  Mesh m;
  m.positions.assign(8, Vec3::Zero());
  m.triangles = {{7, 5, 6}, {2, 0, 4}, {4, 1, 0}};  // vertex 3 unused
  const Components c = components(m);
  EXPECT_EQ(c.count, 2U);
  constexpr auto kNone = Components::kUnused;
  EXPECT_EQ(c.of_vertex, (std::vector<std::uint32_t>{0, 0, 0, kNone, 0, 1, 1, 1}));
  EXPECT_EQ(c.of_triangle, (std::vector<std::uint32_t>{1, 0, 0}));
}

TEST(Components, OfNothing) { EXPECT_EQ(components({}).count, 0U); }

}  // namespace
}  // namespace meniscus::mesh
