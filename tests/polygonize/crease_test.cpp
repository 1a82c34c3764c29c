#include <meniscus/base/random.h>
#include <meniscus/field/combine.h>
#include <meniscus/field/primitives.h>
#include <meniscus/mesh/validate.h>
#include <meniscus/polygonize/polygonize.h>

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

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

/// Two unit balls that meet at `degrees` between the faces: what they have in common, or one less the other. The edge is a
/// circle about the origin across `axis`.
struct Balls {
  std::unique_ptr<field::Field> field;
  Vec3 axis, u, v;
  double apart, radius;

  Balls(double degrees, bool common, double s = 1, const Vec3& shift = Vec3::Zero()) {
    const double half = degrees / 360 * std::numbers::pi;
    apart = s * (common ? std::cos(half) : std::sin(half));
    radius = s * (common ? std::sin(half) : std::cos(half));
    axis = Vec3(0.36, -0.48, 0.8);
    u = axis.unitOrthogonal();
    v = axis.cross(u);
    const auto ball = [&](double side) {
      const Vec3 c = side * apart * axis + shift;
      return field::sphere(at(c.x(), c.y(), c.z()), s);
    };
    field = common ? field::set_intersection(pair(ball(1), ball(-1))) : field::set_difference(pair(ball(1), ball(-1)));
  }
  /// Distance of p to the circle.
  double off(const Vec3& p) const { return std::hypot(p.dot(axis), (p - p.dot(axis) * axis).norm() - radius); }
};

/// Edges at which the mesh turns by more than 20 degrees.
std::vector<std::array<Vec3, 2>> sharp_edges(const mesh::Mesh& m) {
  std::map<std::array<std::int32_t, 2>, Vec3> first;
  std::vector<std::array<Vec3, 2>> sharp;
  const auto p = [&](std::int32_t v) { return m.positions[static_cast<std::size_t>(v)]; };
  for (const Triangle& t : m.triangles) {
    const Vec3 n = (p(t[1]) - p(t[0])).cross(p(t[2]) - p(t[0])).normalized();
    for (std::size_t k = 0; k < 3; ++k) {
      const auto a = t[k], b = t[(k + 1) % 3];
      const auto [other, is_first] = first.try_emplace({std::min(a, b), std::max(a, b)}, n);
      if (!is_first && other->second.dot(n) < 0.94) sharp.push_back({p(a), p(b)});
    }
  }
  return sharp;
}

double distance(const Vec3& p, const std::array<Vec3, 2>& segment) {
  const Vec3 d = segment[1] - segment[0];
  return (segment[0] + std::clamp(d.dot(p - segment[0]) / d.squaredNorm(), 0.0, 1.0) * d - p).norm();
}

// The true edge is within 0.05 voxel of sharp ones of the mesh everywhere, and these are on it. (Below 45 degrees slivers
// without noticeable area stay beside it.)
TEST(Creases, AcuteEdgesAreNotToothed) {
  const double voxel = 0.04;
  for (const bool common : {false, true})
    for (const double degrees : {35.0, 45.0, 60.0, 90.0}) {
      const Balls balls(degrees, common);
      const mesh::Mesh m = polygonize(*balls.field, {.voxel = voxel}).mesh;
      EXPECT_TRUE(mesh::validate(m).good()) << degrees;
      const auto sharp = sharp_edges(m);
      ASSERT_GT(static_cast<double>(sharp.size()), 2 * std::numbers::pi * balls.radius / (2 * voxel));
      std::size_t off = 0;
      for (const auto& edge : sharp)
        if (std::max(balls.off(edge[0]), balls.off(edge[1])) > 1e-6 * voxel) ++off;
      if (degrees >= 45)
        EXPECT_LE(static_cast<double>(off), 0.02 * static_cast<double>(sharp.size())) << degrees << ": teeth";
      for (int i = 0; i < 1000; ++i) {
        const double a = 2 * std::numbers::pi * i / 1000;
        const Vec3 p = balls.radius * (std::cos(a) * balls.u + std::sin(a) * balls.v);
        double best = voxel;
        for (const auto& edge : sharp) best = std::min(best, distance(p, edge));
        ASSERT_LT(best, 0.05 * voxel) << degrees << " common " << common << " at " << i;
      }
    }
}

TEST(Creases, FacesBesideAnAcuteEdgeLieOnTheirSheet) {
  const double voxel = 0.04;
  const Balls balls(45, false);
  const mesh::Mesh m = polygonize(*balls.field, {.voxel = voxel}).mesh;
  double near = 0, wrong = 0;
  for (const Triangle& t : m.triangles) {
    const auto p = [&](std::size_t k) { return m.positions[static_cast<std::size_t>(t[k])]; };
    const Vec3 n = (p(1) - p(0)).cross(p(2) - p(0)), c = (p(0) + p(1) + p(2)) / 3, center = balls.apart * balls.axis;
    if (balls.off(c) > 2 * voxel) continue;
    const bool outer = std::abs((c - center).norm() - 1) < std::abs((c + center).norm() - 1);
    const Vec3 sheet = outer ? Vec3(c - center) : Vec3(-c - center);
    near += n.norm();
    if (n.dot(sheet.normalized()) < 0.97 * n.norm()) wrong += n.norm();
  }
  EXPECT_LT(wrong, 0.005 * near);
}

// The lattice must not show: as the edge moves through it, the volume stays.
TEST(Creases, AcuteEdgesKeepTheirVolumeWhereverTheyAre) {
  for (const double s : {0.01, 1.0, 1000.0}) {
    const double h = 1 - std::cos(std::numbers::pi / 6), exact = 2 * std::numbers::pi * h * h * (3 - h) / 3;
    double least = exact, most = 0;
    for (int i = 0; i < 8; ++i) {
      const Balls balls(60, true, s, s * 0.0123 * i * Vec3(1, 0.7, -0.4));
      const double volume = mesh::volume(polygonize(*balls.field, {.voxel = 0.04 * s}).mesh) / (s * s * s);
      EXPECT_NEAR(volume, exact, 0.005 * exact) << i;
      least = std::min(least, volume);
      most = std::max(most, volume);
    }
    EXPECT_LT(most - least, 0.0004 * exact);
  }
}

TEST(Creases, AcuteEdgesAreTheSameForAnyThreads) {
  const Balls balls(30, false);
  const auto run = [&](int threads) {
    return polygonize(*balls.field, {.voxel = 0.05}, RunControl({.threads = threads, .seed = 0, .on_progress = {}})).mesh;
  };
  const mesh::Mesh one = run(1);
  for (const int threads : {2, 3, 5}) {
    const mesh::Mesh many = run(threads);
    EXPECT_EQ(one.positions, many.positions);
    EXPECT_EQ(one.triangles, many.triangles);
  }
}

}  // namespace
}  // namespace meniscus::polygonize
