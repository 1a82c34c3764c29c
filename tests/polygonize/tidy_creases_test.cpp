#include <meniscus/polygonize/tidy_creases.h>

#include <meniscus/mesh/validate.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace meniscus::polygonize {
namespace {

/// A roof along x from 0 to n: the ridge, vertices 0 to n, is a crease at z = 1; the eaves follow, at y = -1 and at y = 1.
struct Roof {
  Shell shell;
  std::vector<Triangle> triangles;
  int n;

  explicit Roof(std::vector<double> ridge) : n(static_cast<int>(ridge.size()) - 1) {
    for (const double x : ridge) add(Vec3(x, 0, 1), Placed::Crease, Vec3::Zero());
    for (const double side : {-1.0, 1.0})
      for (int i = 0; i <= n; ++i) add(Vec3(i, side, 0), Placed::Newton, Vec3(0, side, 1).normalized());
    shell.placed[0] = shell.placed[static_cast<std::size_t>(n)] = Placed::Corner;
    for (int i = 0; i < n; ++i) {
      const int left = n + 1 + i, right = 2 * (n + 1) + i;
      quad(i, left, left + 1, i + 1);
      quad(i + 1, right + 1, right, i);
      quad(left, right, right + 1, left + 1);
    }
    triangles.push_back({0, 2 * (n + 1), n + 1});
    triangles.push_back({n, 2 * n + 1, 3 * n + 2});
  }

  mesh::Mesh mesh() const {
    mesh::Mesh m;
    m.positions = shell.positions;
    m.triangles = triangles;
    return m;
  }
  /// Triangles of the two slopes that do not face up and outwards.
  std::size_t folded() const {
    std::size_t count = 0;
    for (const Triangle& t : triangles) {
      const auto p = [&](std::size_t k) { return shell.positions[static_cast<std::size_t>(t[k])]; };
      const Vec3 c = (p(0) + p(1) + p(2)) / 3, normal = (p(1) - p(0)).cross(p(2) - p(0));
      if (c.z() < 0.01 || (t[0] == n && c.x() > n - 0.01) || c.x() < 0.01) continue;
      if (!(normal.z() > 0.5 * normal.norm())) ++count;
    }
    return count;
  }
  std::size_t ridge_vertices() const {
    std::set<std::int32_t> used;
    for (const Triangle& t : triangles)
      for (const std::int32_t v : t)
        if (v <= n) used.insert(v);
    return used.size();
  }

 private:
  void add(const Vec3& p, Placed placed, const Vec3& normal) {
    shell.positions.push_back(p);
    shell.placed.push_back(placed);
    shell.normals.push_back(normal);
  }
  void quad(int a, int b, int c, int d) {
    triangles.push_back({a, b, c});
    triangles.push_back({a, c, d});
  }
};

TEST(TidyCreases, LeavesAGoodMeshAlone) {
  Roof roof({0, 1, 2, 3, 4});
  const auto before = roof.triangles;
  tidy_creases(roof.shell, roof.triangles);
  EXPECT_EQ(roof.triangles, before);
  EXPECT_EQ(roof.folded(), 0u);
}

TEST(TidyCreases, UnfoldsARidgeThatRunsBackAndForth) {
  Roof roof({0, 1.4, 0.9, 3.2, 2.6, 5});
  ASSERT_TRUE(mesh::validate(roof.mesh()).closed());
  ASSERT_GT(roof.folded(), 1u);
  tidy_creases(roof.shell, roof.triangles);
  const mesh::Audit audit = mesh::validate(roof.mesh());
  EXPECT_TRUE(audit.closed() && audit.manifold() && audit.oriented() && !audit.degenerate()) << mesh::summary(audit);
  EXPECT_EQ(audit.genus, 0);
  EXPECT_EQ(roof.folded(), 0u);
}

TEST(TidyCreases, MergesVerticesInOnePlaceButKeepsCorners) {
  Roof roof({0, 0, 1, 2, 2, 2.1, 3, 7});
  tidy_creases(roof.shell, roof.triangles);
  const mesh::Audit audit = mesh::validate(roof.mesh());
  EXPECT_TRUE(audit.closed() && audit.manifold() && audit.oriented() && !audit.degenerate()) << mesh::summary(audit);
  EXPECT_EQ(roof.ridge_vertices(), 5u);
  for (const std::int32_t corner : {0, roof.n})
    EXPECT_TRUE(std::any_of(roof.triangles.begin(), roof.triangles.end(), [&](const Triangle& t) {
      return std::find(t.begin(), t.end(), corner) != t.end();
    })) << corner;
}

TEST(TidyCreases, TurnsTheSideOfASliverAlongTheRidge) {
  // The left slope's edge from 0 to 2 passes vertex 1, which is joined to it by a triangle without area.
  Roof roof({0, 1, 2});
  const auto at = [&](const Triangle& t) { return std::find(roof.triangles.begin(), roof.triangles.end(), t); };
  const int left = roof.n + 1;
  *at({0, left + 1, 1}) = {0, left + 1, 2};
  *at({1, left + 1, left + 2}) = {0, 2, 1};
  *at({1, left + 2, 2}) = {2, left + 1, left + 2};
  ASSERT_TRUE(mesh::validate(roof.mesh()).closed() && mesh::validate(roof.mesh()).oriented());
  ASSERT_EQ(mesh::validate(roof.mesh()).zero_area_triangles, 1u);
  tidy_creases(roof.shell, roof.triangles);
  const mesh::Audit audit = mesh::validate(roof.mesh());
  EXPECT_TRUE(audit.closed() && audit.manifold() && audit.oriented() && !audit.degenerate()) << mesh::summary(audit);
  EXPECT_EQ(roof.ridge_vertices(), 3u);
}

}  // namespace
}  // namespace meniscus::polygonize
