#include "formula_field.h"

#include <meniscus/base/error.h>
#include <meniscus/base/random.h>
#include <meniscus/field/blobs.h>
#include <meniscus/field/primitives.h>
#include <meniscus/mesh/components.h>
#include <meniscus/mesh/validate.h>
#include <meniscus/polygonize/polygonize.h>

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace meniscus::polygonize {
namespace {

constexpr double kPi = std::numbers::pi;

PolygonizeResult meshed(const field::Field& field, double voxel, std::optional<Box> box = {}) {
  PolygonizeOptions options;
  options.voxel = voxel;
  options.box = box;
  PolygonizeResult result = polygonize(field, options);
  const mesh::Audit audit = mesh::validate(result.mesh);
  EXPECT_TRUE(audit.good()) << mesh::summary(audit);
  EXPECT_EQ(audit.unused_vertices, 0U);
  EXPECT_EQ(audit.components, result.report.components);
  return result;
}

field::Number3 at(double x, double y, double z) { return {x, y, z}; }

TEST(Polygonize, SphereConvergesAtSecondOrder) {
  const auto sphere = field::sphere(at(0.013, -0.027, 0.041), 1.0);
  double last_area = 0;
  double last_volume = 0;
  for (const double voxel : {0.1, 0.05, 0.025}) {
    const PolygonizeResult r = meshed(*sphere, voxel);
    const double area_error = 4 * kPi - mesh::area(r.mesh);
    const double volume_error = 4 * kPi / 3 - mesh::volume(r.mesh);
    EXPECT_GT(area_error, 0);
    EXPECT_LT(area_error, 4 * kPi * voxel * voxel / 4);
    if (last_area > 0) {
      EXPECT_NEAR(last_area / area_error, 4, 0.3);
      EXPECT_NEAR(last_volume / volume_error, 4, 0.3);
    }
    last_area = area_error;
    last_volume = volume_error;
    EXPECT_LE(r.report.worst_residual, 1.01e-9);
    EXPECT_EQ(r.report.vertices_at_box, 0U);
    EXPECT_TRUE(r.report.warnings.empty());
  }
}

TEST(Polygonize, VerticesAreOnTheSurfaceWithUnitGradientNormals) {
  const Vec3 c(0.3, 0.1, -0.2);
  const PolygonizeResult r = meshed(*field::sphere(at(c.x(), c.y(), c.z()), 0.7), 0.06);
  const auto normals = std::as_const(r.mesh.attributes).values(attribute::kNormal, 3);
  ASSERT_EQ(normals.size(), 3 * r.mesh.positions.size());
  for (std::size_t v = 0; v < r.mesh.positions.size(); ++v) {
    const Vec3 out = r.mesh.positions[v] - c;
    EXPECT_NEAR(out.norm(), 0.7, 1e-9 * 0.06);
    EXPECT_LT((Vec3(normals[3 * v], normals[3 * v + 1], normals[3 * v + 2]) - out.normalized()).norm(), 1e-9);
  }
}

TEST(Polygonize, TorusHasGenusOne) {
  const PolygonizeResult r = meshed(*field::torus(at(0, 0, 0), at(1, 2, 3), 1.0, 0.3), 0.07);
  EXPECT_EQ(mesh::validate(r.mesh).genus, 1);
  EXPECT_NEAR(mesh::volume(r.mesh), 2 * kPi * kPi * 0.09, 0.02);
}

TEST(Polygonize, TrianglesAreWellShaped) {
  const PolygonizeResult r = meshed(*field::sphere(at(0.013, -0.027, 0.041), 1.0), 0.05);
  std::size_t thin = 0;
  for (const Triangle& t : r.mesh.triangles) {
    double least = kPi;
    for (std::size_t c = 0; c < 3; ++c) {
      const auto p = [&](std::size_t n) { return r.mesh.positions[static_cast<std::size_t>(t[(c + n) % 3])]; };
      least = std::min(least, std::acos((p(1) - p(0)).normalized().dot((p(2) - p(0)).normalized())));
    }
    if (least < kPi / 12) ++thin;
  }
  EXPECT_LT(thin, r.mesh.triangles.size() / 100) << thin << " of " << r.mesh.triangles.size();
}

// Two sheets that leave the box: each is closed by a cap on the box.
TEST(Polygonize, HyperboloidOfTwoSheetsIsClosedAtTheBox) {
  const FormulaField f([](const Vec3& p) { return 0.04 - p.z() * p.z() + p.x() * p.x() + p.y() * p.y(); },
                       Box::everywhere());
  const Box box{Vec3(-0.83, -0.83, -0.71), Vec3(0.83, 0.83, 0.71)};
  const PolygonizeResult r = meshed(f, 0.05, box);
  EXPECT_EQ(r.report.components, 2U);
  EXPECT_EQ(mesh::validate(r.mesh).genus, 0);
  EXPECT_GT(r.report.vertices_at_box, 100U);
  ASSERT_EQ(r.report.warnings.size(), 1U);
  EXPECT_NE(r.report.warnings[0].find("leaves the box"), std::string::npos);
  for (const Vec3& p : r.mesh.positions) EXPECT_TRUE(box.padded(1e-9).contains(p)) << p.transpose();
  // Each sheet: integral of pi (z² - 0.04) from 0.2 to 0.71.
  const double sheet = kPi * ((std::pow(0.71, 3) - 0.008) / 3 - 0.04 * 0.51);
  EXPECT_NEAR(mesh::volume(r.mesh), 2 * sheet, 0.02 * sheet);
}

TEST(Polygonize, GyroidPatchHasTheTopologyOfItsCell) {
  const FormulaField f(
      [](const Vec3& p) {
        const auto [x, y, z] = std::tuple{2 * kPi * p.x(), 2 * kPi * p.y(), 2 * kPi * p.z()};
        return std::sin(x) * std::cos(y) + std::sin(y) * std::cos(z) + std::sin(z) * std::cos(x);
      },
      Box::everywhere());
  const Box box{Vec3::Constant(-1.03), Vec3::Constant(1.03)};
  const PolygonizeResult coarse = meshed(f, 0.06, box);
  const PolygonizeResult fine = meshed(f, 0.03, box);
  EXPECT_EQ(coarse.report.components, fine.report.components);
  EXPECT_GT(mesh::validate(fine.mesh).genus, 10);
  EXPECT_EQ(mesh::validate(coarse.mesh).genus, mesh::validate(fine.mesh).genus);
  EXPECT_NEAR(mesh::volume(fine.mesh), std::pow(2.06, 3) / 2, 0.05);
}

TEST(Polygonize, FindsFiftySpheresOfVeryDifferentSize) {
  std::vector<Vec3> centers;
  std::vector<double> radii;
  double volume = 0;
  double place = 0;
  for (std::uint64_t i = 0; i < 50; ++i) {
    const double radius = 0.01 * std::pow(100.0, std::pow(static_cast<double>(i) / 49, 3));  // 1:100, most of them small
    const auto r = random_uniform(7, i, 0);
    place += 4.4 * radius;  // supports reach two radii
    centers.emplace_back(place, 5 * r[0], 5 * r[1]);
    radii.push_back(radius);
    volume += 4 * kPi / 3 * std::pow(radius, 3);
  }
  // A ball of radius √3/2 voxel always holds a lattice point; the smallest one is just larger.
  const PolygonizeResult r = meshed(*field::particles(centers, radii), 0.011);
  EXPECT_EQ(r.report.components, 50U);
  EXPECT_NEAR(mesh::volume(r.mesh), volume, 2e-3 * volume);
}

TEST(Polygonize, ThinPlateOfOneVoxelAndABit) {
  const PolygonizeResult r = meshed(*field::box(at(0.03, 0.02, 0.01), at(2, 2, 0.055)), 0.05);
  EXPECT_EQ(r.report.components, 1U);
  EXPECT_EQ(mesh::validate(r.mesh).genus, 0);
  EXPECT_NEAR(mesh::volume(r.mesh), 4 * 0.055, 0.02);
}

// Faces exactly on lattice planes: every sample there is zero.
TEST(Polygonize, SurfaceThroughLatticePoints) {
  const PolygonizeResult r = meshed(*field::box(at(0, 0, 0), at(2, 1, 0.5)), 0.125);
  EXPECT_EQ(r.report.components, 1U);
  EXPECT_NEAR(mesh::volume(r.mesh), 1, 1e-9);
  const FormulaField diagonal([](const Vec3& p) { return p.x() + p.y() + p.z(); }, Box::everywhere());
  meshed(diagonal, 0.25, Box{Vec3::Constant(-1), Vec3::Constant(1)});
}

TEST(Polygonize, ScaleChangesNothingButScale) {
  const PolygonizeResult one = meshed(*field::torus(at(0.1, 0.2, 0.3), at(1, 2, 3), 1.0, 0.31), 0.0701);
  for (const double s : {0.01, 1000.0}) {
    const PolygonizeResult r =
        meshed(*field::torus(at(0.1 * s, 0.2 * s, 0.3 * s), at(1, 2, 3), 1.0 * s, 0.31 * s), 0.0701 * s);
    ASSERT_EQ(r.mesh.triangles, one.mesh.triangles);
    for (std::size_t v = 0; v < one.mesh.positions.size(); ++v)
      ASSERT_LT((r.mesh.positions[v] / s - one.mesh.positions[v]).norm(), 1e-9);
  }
}

// The same with a field whose values have no length in them, cut by a box.
TEST(Polygonize, ScaleChangesNothingWhereABoxCuts) {
  const auto make = [](double s) {
    std::vector<Vec3> centers;
    for (std::uint64_t i = 0; i < 30; ++i) {
      const auto r = random_uniform(11, i, 0);
      centers.emplace_back(s * Vec3(r[0], r[1], r[2]));
    }
    const Box box{Vec3(0.21, 0.22, 0.23) * s, Vec3(0.71, 0.72, 0.73) * s};
    return meshed(*field::particles(centers, std::vector<double>{0.12 * s}), 0.0303 * s, box);
  };
  const PolygonizeResult one = make(1);
  EXPECT_GT(one.report.vertices_at_box, 100U);
  for (const double s : {0.01, 1000.0}) {
    const PolygonizeResult r = make(s);
    ASSERT_EQ(r.mesh.triangles, one.mesh.triangles);
    EXPECT_EQ(r.report.vertices_bisected, one.report.vertices_bisected);
    for (std::size_t v = 0; v < one.mesh.positions.size(); ++v)
      ASSERT_LT((r.mesh.positions[v] / s - one.mesh.positions[v]).norm(), 1e-9);
  }
}

TEST(Polygonize, SameBitsForAnyNumberOfThreads) {
  std::vector<Vec3> centers;
  for (std::uint64_t i = 0; i < 200; ++i) {
    const auto r = random_uniform(3, i, 0);
    centers.emplace_back(r[0], r[1], r[2]);
  }
  const auto field = field::particles(centers, std::vector<double>{0.06});
  const auto run = [&](int threads) {
    return polygonize(*field, {.voxel = 0.02}, RunControl({.threads = threads, .seed = 0, .on_progress = {}})).mesh;
  };
  const mesh::Mesh one = run(1);
  EXPECT_TRUE(mesh::validate(one).good());
  for (const int threads : {2, 3, 5, 8}) {
    const mesh::Mesh other = run(threads);
    EXPECT_EQ(one.positions, other.positions);
    EXPECT_EQ(one.triangles, other.triangles);
    EXPECT_TRUE(
        std::ranges::equal(one.attributes.values(attribute::kNormal, 3), other.attributes.values(attribute::kNormal, 3)));
  }
}

// Cells do not move with the box: where both meshes exist they have the same vertices.
TEST(Polygonize, CellsAreAlignedToMultiplesOfTheVoxel) {
  const auto sphere = field::sphere(at(0, 0, 0), 1.0);
  const PolygonizeResult a = meshed(*sphere, 0.07);
  const PolygonizeResult b = meshed(*sphere, 0.07, Box{Vec3(-3.3, -2.1, -1.9), Vec3(5.1, 2.2, 7.7)});
  EXPECT_EQ(a.mesh.positions, b.mesh.positions);
  EXPECT_EQ(a.mesh.triangles, b.mesh.triangles);
}

TEST(Polygonize, EmptySurfacesAreEmptyMeshes) {
  const FormulaField nothing([](const Vec3&) { return 1.0; }, Box{});
  EXPECT_TRUE(meshed(nothing, 0.1).mesh.triangles.empty());
  EXPECT_TRUE(
      meshed(*field::sphere(at(0, 0, 0), 1.0), 0.1, Box{Vec3::Constant(2), Vec3::Constant(3)}).mesh.positions.empty());
}

TEST(Polygonize, AllInsideIsTheBoxItself) {
  const FormulaField solid([](const Vec3&) { return -1.0; }, Box::everywhere());
  const PolygonizeResult r = meshed(solid, 0.1, Box{Vec3(-0.43, -0.31, 0.22), Vec3(0.57, 0.69, 1.22)});
  EXPECT_NEAR(mesh::volume(r.mesh), 1, 0.03);
  EXPECT_EQ(r.report.vertices_at_box, r.mesh.positions.size());
}

TEST(Polygonize, NanIsOutsideAndCounted) {
  const FormulaField half([](const Vec3& p) { return p.x() > 0.011 ? std::nan("") : p.norm() - 1; },
                          Box::around(Vec3::Zero(), 1.0));
  const PolygonizeResult r = meshed(half, 0.1);
  EXPECT_GT(r.report.nan_samples, 0U);
  ASSERT_FALSE(r.report.warnings.empty());
  EXPECT_NEAR(mesh::volume(r.mesh), 2 * kPi / 3, 0.25);
  for (const Vec3& p : r.mesh.positions) EXPECT_LT(p.x(), 0.011 + 1e-6);
}

TEST(Polygonize, SignOnlyFieldsAreBisected) {
  const FormulaField step([](const Vec3& p) { return (p - Vec3(0.01, 0.02, 0.03)).norm() < 1 ? -1.0 : 1.0; },
                          Box::around(Vec3(0.01, 0.02, 0.03), 1.0));
  const PolygonizeResult r = meshed(step, 0.1);
  EXPECT_EQ(r.report.vertices_bisected, r.mesh.positions.size());
  for (const Vec3& p : r.mesh.positions) EXPECT_NEAR((p - Vec3(0.01, 0.02, 0.03)).norm(), 1, 1e-9);
}

TEST(Polygonize, AStrayParticleFarAwayCostsNothingNoticeable) {
  std::vector<Vec3> centers;
  for (std::uint64_t i = 0; i < 100; ++i) {
    const auto r = random_uniform(5, i, 0);
    centers.emplace_back(r[0], r[1], r[2]);
  }
  const PolygonizeResult near = meshed(*field::particles(centers, std::vector<double>{0.1}), 0.05);
  centers.emplace_back(1e5, -1e5, 0.3e5);  // a million radii
  const PolygonizeResult far = meshed(*field::particles(centers, std::vector<double>{0.1}), 0.05);
  EXPECT_EQ(far.report.components, near.report.components + 1);
  EXPECT_LT(far.report.evaluations, near.report.evaluations + 30'000);
  EXPECT_LT(far.report.boxes_tested, near.report.boxes_tested + 2'000);
}

// Blobs of any size and overlap, cut by a box that may pass through them: always a good mesh, on the surface.
TEST(Polygonize, RandomScenesGiveGoodMeshes) {
  std::size_t moved = 0;
  std::size_t vertices = 0;
  for (std::uint64_t seed = 0; seed < 150; ++seed) {
    std::vector<Vec3> centers;
    std::vector<double> radii;
    for (std::uint64_t i = 0; i < 1 + seed % 20; ++i) {
      const auto r = random_uniform(seed, i, 0);
      centers.emplace_back(r[0], r[1], r[2]);
      radii.push_back(0.02 + 0.3 * r[3] * r[3]);
    }
    const auto field = field::particles(centers, radii);
    std::optional<Box> box;
    if (seed % 3 == 0) box = Box{Vec3(0.1, 0.2, 0.3), Vec3(0.8, 0.7, 0.9)};
    const PolygonizeResult r = meshed(*field, 0.03 + 0.0001 * static_cast<double>(seed), box);
    moved += r.report.vertices_moved;
    vertices += r.mesh.positions.size();
    EXPECT_LE(r.report.worst_residual, 1.01e-9);
  }
  EXPECT_LE(moved, vertices / 10'000) << moved << " of " << vertices;
}

TEST(Polygonize, RefusesWhatHasNoMeaning) {
  const auto sphere = field::sphere(at(0, 0, 0), 1.0);
  EXPECT_THROW(polygonize(*sphere, {}), InvalidInput);
  EXPECT_THROW(polygonize(*sphere, {.voxel = -1}), InvalidInput);
  EXPECT_THROW(polygonize(*sphere, {.voxel = std::nan("")}), InvalidInput);
  EXPECT_THROW(polygonize(*field::plane(at(0, 0, 0), at(0, 0, 1)), {.voxel = 0.1}), InvalidInput);
  EXPECT_THROW(polygonize(*sphere, {.voxel = 1e-10}), ResourceLimit);
  EXPECT_THROW(polygonize(*sphere, {.voxel = 0.01, .max_triangles = 1000}), ResourceLimit);
  EXPECT_THROW(polygonize(*sphere, {.voxel = 0.01, .max_cells = 100'000}), ResourceLimit);
}

}  // namespace
}  // namespace meniscus::polygonize
