#include <meniscus/base/random.h>
#include <meniscus/field/combine.h>
#include <meniscus/field/primitives.h>
#include <meniscus/mesh/validate.h>
#include <meniscus/polygonize/polygonize.h>

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::polygonize {
namespace {

field::Number3 at(double x, double y, double z) { return {x, y, z}; }

field::Inputs pair(std::unique_ptr<field::Field> a, std::unique_ptr<field::Field> b) {
  field::Inputs inputs;
  inputs.push_back(std::move(a));
  inputs.push_back(std::move(b));
  return inputs;
}

/// A unit cube with its center off the lattice; with a bore of radius 0.3 along z if asked for.
std::unique_ptr<field::Field> cube(double s, bool bored) {
  auto body = field::box(at(0.013 * s, -0.021 * s, 0.017 * s), at(s, s, s));
  if (!bored) return body;
  return field::set_difference(
      pair(std::move(body), field::capsule(at(0.02 * s, 0.03 * s, -3 * s), at(0.02 * s, 0.03 * s, 3 * s), 0.3 * s)));
}

TEST(Creases, AUnitCubeIsExactAtAnyScale) {
  for (const double s : {0.01, 1.0, 1000.0}) {
    const PolygonizeResult r = polygonize(*cube(s, false), {.voxel = 0.07 * s});
    EXPECT_TRUE(mesh::validate(r.mesh).good());
    EXPECT_NEAR(mesh::volume(r.mesh) / (s * s * s), 1, 1e-6);
    EXPECT_NEAR(mesh::area(r.mesh) / (s * s), 6, 1e-6);
    EXPECT_GT(r.report.vertices_on_creases, 150U);
    EXPECT_LE(r.report.worst_residual, 1.01e-9);
  }
  const PolygonizeResult off = polygonize(*cube(1, false), {.voxel = 0.07, .creases = false});
  EXPECT_EQ(off.report.vertices_on_creases, 0U);
  EXPECT_GT(std::abs(mesh::volume(off.mesh) - 1), 1e-4);
}

// The rim of the bore on the top face: a circle. Every cell it passes through has a vertex on it.
TEST(Creases, VerticesAreOnTheRimOfABore) {
  const double voxel = 0.04;
  const auto on_rim = [&](const PolygonizeResult& r) {
    std::size_t count = 0;
    for (const Vec3& p : r.mesh.positions) {
      const double across = std::hypot(p.x() - 0.02, p.y() - 0.03) - 0.3;
      if (std::hypot(across, p.z() - 0.517) < 1e-3 * voxel) ++count;
    }
    return count;
  };
  const PolygonizeResult on = polygonize(*cube(1, true), {.voxel = voxel});
  const PolygonizeResult off = polygonize(*cube(1, true), {.voxel = voxel, .creases = false});
  EXPECT_TRUE(mesh::validate(on.mesh).good());
  EXPECT_EQ(mesh::validate(on.mesh).genus, 1);
  EXPECT_GT(on_rim(on), 47U);  // circumference over voxel
  EXPECT_LT(on_rim(off), 10U);
  EXPECT_LE(on.report.worst_residual, 1.01e-9);
}

TEST(Creases, SmoothSurfacesHaveNone) {
  for (const double voxel : {0.5, 0.3, 0.1}) {
    const auto sphere = field::sphere(at(0.013, -0.027, 0.041), 1.0);
    const PolygonizeResult on = polygonize(*sphere, {.voxel = voxel});
    EXPECT_EQ(on.report.vertices_on_creases, 0U);
    EXPECT_EQ(on.mesh.positions, polygonize(*sphere, {.voxel = voxel, .creases = false}).mesh.positions);
  }
}

TEST(Creases, RandomPartsGiveGoodMeshesWithTheSameBitsForAnyThreads) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    field::Inputs inputs;
    for (std::uint64_t i = 0; i < 5; ++i) {
      const auto r = random_uniform(seed, i, 0);
      const auto q = random_uniform(seed, i, 1);
      if (i % 2 == 0)
        inputs.push_back(field::box(at(r[0], r[1], r[2]), at(0.1 + q[0], 0.1 + q[1], 0.1 + q[2])));
      else
        inputs.push_back(field::capsule(at(r[0], r[1], r[2]), at(q[0], q[1], q[2]), 0.05 + 0.2 * r[3]));
    }
    const auto part = seed % 2 == 0 ? field::set_difference(std::move(inputs)) : field::set_union(std::move(inputs));
    const auto run = [&](int threads) {
      return polygonize(*part, {.voxel = 0.06}, RunControl({.threads = threads, .seed = 0, .on_progress = {}}));
    };
    const PolygonizeResult one = run(1);
    EXPECT_TRUE(mesh::validate(one.mesh).good()) << seed;
    EXPECT_LE(one.report.worst_residual, 1.01e-9);
    const PolygonizeResult three = run(3);
    EXPECT_EQ(one.mesh.positions, three.mesh.positions);
    EXPECT_EQ(one.mesh.triangles, three.mesh.triangles);
  }
}

}  // namespace
}  // namespace meniscus::polygonize
