#include <meniscus/mesh/validate.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace meniscus::mesh {
namespace {

Mesh tetrahedron(const Vec3& at = Vec3::Zero()) {
  Mesh m;
  m.positions = {at, at + Vec3::UnitX(), at + Vec3::UnitY(), at + Vec3::UnitZ()};
  m.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return m;
}

void append(Mesh& mesh, const Mesh& other) {
  const auto offset = static_cast<std::int32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
  for (const Triangle& t : other.triangles) mesh.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
}

/// A torus of n×n quads.
Mesh torus(std::int32_t n) {
  Mesh m;
  for (std::int32_t i = 0; i < n; ++i)
    for (std::int32_t j = 0; j < n; ++j) {
      const double u = 6.283185307 * i / n;
      const double v = 6.283185307 * j / n;
      m.positions.emplace_back((2 + std::cos(v)) * std::cos(u), (2 + std::cos(v)) * std::sin(u), std::sin(v));
      const auto id = [&](std::int32_t a, std::int32_t b) { return (a % n) * n + b % n; };
      m.triangles.push_back({id(i, j), id(i + 1, j), id(i + 1, j + 1)});
      m.triangles.push_back({id(i, j), id(i + 1, j + 1), id(i, j + 1)});
    }
  return m;
}

TEST(Validate, TetrahedronIsGood) {
  const Audit a = validate(tetrahedron());
  EXPECT_TRUE(a.good());
  EXPECT_EQ(a.edges, 6U);
  EXPECT_EQ(a.euler, 2);
  EXPECT_EQ(a.genus, 0);
  EXPECT_EQ(a.components, 1U);
  EXPECT_EQ(summary(a), "closed, manifold, oriented: 1 component, genus 0, 4 vertices, 4 triangles");
}

TEST(Validate, GenusOfTorusAndOfSeveralParts) {
  EXPECT_EQ(validate(torus(7)).genus, 1);
  Mesh both = torus(5);
  append(both, torus(6));
  append(both, tetrahedron());
  const Audit a = validate(both);
  EXPECT_TRUE(a.good());
  EXPECT_EQ(a.genus, 2);
  EXPECT_EQ(a.components, 3U);
}

TEST(Validate, EmptyMeshIsGood) { EXPECT_TRUE(validate(Mesh{}).good()); }

TEST(Validate, MissingTriangleOpensTheMesh) {
  Mesh m = tetrahedron();
  m.triangles.pop_back();
  const Audit a = validate(m);
  EXPECT_FALSE(a.closed());
  EXPECT_TRUE(a.manifold());
  EXPECT_EQ(a.boundary_edges, 3U);
  EXPECT_FALSE(a.genus.has_value());
}

TEST(Validate, FlippedTriangleIsMisoriented) {
  Mesh m = tetrahedron();
  std::swap(m.triangles[0][0], m.triangles[0][1]);
  const Audit a = validate(m);
  EXPECT_EQ(a.misoriented_edges, 3U);
  EXPECT_TRUE(a.closed());
  EXPECT_FALSE(a.good());
}

TEST(Validate, TwoTetrahedraAtOneVertexAreNotManifoldThere) {
  Mesh m = tetrahedron();
  append(m, tetrahedron(Vec3(-5, 0, 0)));
  for (Triangle& t : m.triangles)
    for (auto& v : t) v = v == 4 ? 0 : v;
  const Audit a = validate(m);
  EXPECT_EQ(a.nonmanifold_vertices, 1U);
  EXPECT_EQ(a.nonmanifold_edges, 0U);
  EXPECT_EQ(a.unused_vertices, 1U);
  EXPECT_EQ(a.components, 1U);
}

TEST(Validate, TwoTetrahedraAtOneEdgeAreNotManifoldThere) {
  Mesh m = tetrahedron();
  append(m, tetrahedron(Vec3(-5, 0, 0)));
  for (Triangle& t : m.triangles)
    for (auto& v : t) v = v == 4 ? 0 : v == 5 ? 1 : v;
  EXPECT_EQ(validate(m).nonmanifold_edges, 1U);
}

TEST(Validate, CountsEveryKindOfBadTriangle) {
  Mesh m = tetrahedron();
  m.triangles.push_back({0, 1, 99});
  m.triangles.push_back({0, -1, 2});
  m.triangles.push_back({2, 2, 1});
  m.triangles.push_back({2, 0, 1});  // the first one again, turned round
  m.positions.emplace_back(2, 0, 0);
  m.triangles.push_back({0, 1, 4});  // in a line
  const Audit a = validate(m);
  EXPECT_EQ(a.out_of_range_triangles, 2U);
  EXPECT_EQ(a.repeated_vertices, 1U);
  EXPECT_EQ(a.duplicate_triangles, 1U);
  EXPECT_EQ(a.zero_area_triangles, 1U);
  EXPECT_EQ(a.triangles, 6U);
  EXPECT_FALSE(a.good());
}

TEST(Validate, NonFiniteAndMismatchedContents) {
  Mesh m = tetrahedron();
  m.positions[1].x() = std::numeric_limits<double>::quiet_NaN();
  m.attributes.set("N", 3, std::vector<double>(9, 0));
  m.attributes.set("heat", 1, {1, 2, 3, std::numeric_limits<double>::infinity()});
  const Audit a = validate(m);
  EXPECT_EQ(a.nonfinite_vertices, 1U);
  EXPECT_EQ(a.nonfinite_attributes, 1U);
  EXPECT_EQ(a.attribute_mismatches, std::vector<std::string>{"N"});
  EXPECT_FALSE(a.finite());
}

TEST(Validate, AreaIsJudgedAtAnyScale) {
  for (const double scale : {1e-200, 0.01, 1000.0, 1e200}) {
    Mesh m = tetrahedron();
    for (Vec3& p : m.positions) p *= scale;
    EXPECT_TRUE(validate(m).good()) << scale;
    m.positions[3] = 0.5 * (m.positions[1] + m.positions[2]);
    EXPECT_EQ(validate(m).zero_area_triangles, 1U) << scale;
  }
}

}  // namespace
}  // namespace meniscus::mesh
