#include <meniscus/band/triangle_tree.h>

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace meniscus::band {
namespace {

/// By dense sampling of one triangle.
double sampled_distance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  double best = 1e300;
  constexpr int kSteps = 300;
  for (int i = 0; i <= kSteps; ++i)
    for (int j = 0; i + j <= kSteps; ++j)
      best = std::min(best, (p - a - i * (b - a) / kSteps - j * (c - a) / kSteps).norm());
  return best;
}

struct Soup {
  mesh::Mesh mesh;
  explicit Soup(std::size_t count, double size) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> u(-1, 1);
    const auto vec = [&] { return Vec3(u(random), u(random), u(random)); };
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3 center = vec();
      const auto n = static_cast<std::int32_t>(3 * i);
      for (int k = 0; k < 3; ++k) mesh.positions.push_back(center + size * vec());
      mesh.triangles.push_back({n, n + 1, n + 2});
    }
  }
};

TEST(TriangleTree, OneTriangleFromEverySide) {
  const Soup soup(1, 1);
  const TriangleTree tree(soup.mesh);
  const auto& p = soup.mesh.positions;
  std::mt19937 random(6);
  std::uniform_real_distribution<double> u(-2, 2);
  for (int n = 0; n < 200; ++n) {
    const Vec3 x(u(random), u(random), u(random));
    const double sampled = sampled_distance(x, p[0], p[1], p[2]), d = tree.distance(x, 100);
    EXPECT_LE(d, sampled + 1e-12);
    EXPECT_GE(d, sampled - 0.01);
  }
}

TEST(TriangleTree, AnswersAreThoseOfTheNearestTriangle) {
  const Soup soup(500, 0.1);
  const TriangleTree tree(soup.mesh);
  std::vector<TriangleTree> alone;
  for (std::size_t i = 0; i < soup.mesh.triangles.size(); ++i) {
    mesh::Mesh one;
    for (std::size_t k = 0; k < 3; ++k) one.positions.push_back(soup.mesh.positions[3 * i + k]);
    one.triangles = {{0, 1, 2}};
    alone.emplace_back(one);
  }
  std::mt19937 random(7);
  std::uniform_real_distribution<double> u(-1.5, 1.5);
  for (int n = 0; n < 300; ++n) {
    const Vec3 x(u(random), u(random), u(random));
    double best = 100;
    for (const TriangleTree& t : alone) best = std::min(best, t.distance(x, 100));
    EXPECT_EQ(tree.distance(x, 100), best);
    EXPECT_EQ(tree.distance(x, 0.5 * best), 0.5 * best);
    EXPECT_EQ(tree.distance(x, 1.01 * best), best);
  }
}

TEST(TriangleTree, DegenerateTrianglesAndNone) {
  EXPECT_EQ(TriangleTree({}).distance(Vec3::Zero(), 3), 3);
  mesh::Mesh m;
  m.positions = {{0, 0, 0}, {2, 0, 0}, {1, 0, 0}};
  m.triangles = {{0, 1, 2}, {0, 0, 0}, {0, 1, 1}};
  EXPECT_DOUBLE_EQ(TriangleTree(m).distance({1.5, 3, 4}, 100), 5);
  EXPECT_DOUBLE_EQ(TriangleTree(m).distance({-3, 0, 4}, 100), 5);
}

}  // namespace
}  // namespace meniscus::band
