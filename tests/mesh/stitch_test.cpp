#include <meniscus/mesh/stitch.h>
#include <meniscus/mesh/validate.h>

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::mesh {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// A ring of `n` vertices of the given radius at the mesh's end, walked anticlockwise about +z.
std::vector<std::int32_t> add_ring(Mesh& mesh, int n, double radius, double turn = 0) {
  std::vector<std::int32_t> ring;
  for (int i = 0; i < n; ++i) {
    const double angle = turn + 2 * kPi * i / n;
    ring.push_back(static_cast<std::int32_t>(mesh.positions.size()));
    mesh.positions.emplace_back(radius * std::cos(angle), radius * std::sin(angle), 0);
  }
  return ring;
}

/// A flat disc: a fan about its centre.
Mesh disc(int n, double radius, double turn = 0) {
  Mesh mesh;
  mesh.positions.emplace_back(0, 0, 0);
  const auto ring = add_ring(mesh, n, radius, turn);
  for (std::size_t i = 0; i < ring.size(); ++i) mesh.triangles.push_back({0, ring[i], ring[(i + 1) % ring.size()]});
  return mesh;
}

TEST(BoundaryLoops, KeepTheSurfaceOnTheLeft) {
  const Mesh mesh = disc(6, 1);
  const auto loops = boundary_loops(mesh);
  ASSERT_EQ(loops.size(), 1u);
  EXPECT_EQ(loops[0], (Loop{1, 2, 3, 4, 5, 6}));
  EXPECT_TRUE(boundary_loops(Mesh{}).empty());
}

TEST(BoundaryLoops, ThoseThatTouchAreParted) {
  // Two squares that share a corner, and one that stands alone.
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 1, 0},
                    {2, 2, 0}, {1, 2, 0}, {5, 0, 0}, {6, 0, 0}, {6, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {2, 4, 5}, {2, 5, 6}, {7, 8, 9}};
  EXPECT_EQ(part_touching_loops(mesh), (std::vector<std::int32_t>{4}));
  ASSERT_EQ(mesh.triangles.size(), 1u);
  EXPECT_EQ(boundary_loops(mesh), (std::vector<Loop>{{7, 8, 9}}));
}

TEST(StripBetween, FillsARingOfAnyTwoCounts) {
  for (const int outer : {3, 8, 40}) {
    for (const int inner : {3, 5, 60}) {
      // An annulus about a disc: its hole has the surface on the left when walked clockwise.
      Mesh mesh = disc(inner, 1, 0.3);
      const std::size_t before = mesh.triangles.size();
      const auto ring = add_ring(mesh, outer, 2.5);
      const Loop hole(ring.rbegin(), ring.rend());
      const std::vector<Vec3> up(mesh.positions.size(), Vec3(0, 0, 1));
      const auto strip = strip_between(mesh, up, hole, boundary_loops(mesh)[0]);
      ASSERT_TRUE(strip.has_value());
      EXPECT_EQ(strip->size(), static_cast<std::size_t>(outer + inner));
      mesh.triangles.insert(mesh.triangles.end(), strip->begin(), strip->end());
      // A disc again, bounded by the outer ring: every piece of it covered once, nothing turned over.
      const Audit audit = validate(mesh);
      EXPECT_TRUE(audit.manifold() && audit.oriented());
      EXPECT_EQ(audit.boundary_edges, static_cast<std::size_t>(outer));
      EXPECT_EQ(audit.euler, 1);
      const double polygon = 0.5 * outer * 2.5 * 2.5 * std::sin(2 * kPi / outer);
      if (outer > 3) EXPECT_NEAR(area(mesh), polygon, 1e-12) << outer << ' ' << inner << ' ' << before;
    }
  }
}

TEST(StripBetween, RefusesWhatIsNoLoop) {
  const Mesh mesh = disc(5, 1);
  const std::vector<Vec3> up(mesh.positions.size(), Vec3(0, 0, 1));
  EXPECT_FALSE(strip_between(mesh, up, {1, 2}, {3, 4, 5}).has_value());
}

}  // namespace
}  // namespace meniscus::mesh
