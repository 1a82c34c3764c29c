#include <meniscus/base/random.h>
#include <meniscus/mesh/validate.h>
#include <meniscus/polygonize/polygonize.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace meniscus::polygonize {
namespace {

constexpr double kPi = std::numbers::pi;

/// Samples of `f` in the bricks where |f| < 4 voxels somewhere.
template <class F>
field::Grid narrow_band(const F& f, double voxel, const Vec3& origin, int reach) {
  std::vector<field::Coord> bricks;
  std::vector<float> values;
  for (int bx = -reach; bx < reach; ++bx)
    for (int by = -reach; by < reach; ++by)
      for (int bz = -reach; bz < reach; ++bz) {
        std::vector<float> brick;
        float nearest = 1e30F;
        for (int n = 0; n < 512; ++n) {
          const Vec3 ijk(8 * bx + (n >> 6), 8 * by + ((n >> 3) & 7), 8 * bz + (n & 7));
          brick.push_back(static_cast<float>(f(Vec3(origin + voxel * ijk))));
          nearest = std::min(nearest, std::abs(brick.back()));
        }
        if (nearest > 4 * voxel) continue;
        bricks.push_back({bx, by, bz});
        values.insert(values.end(), brick.begin(), brick.end());
      }
  return {voxel, origin, 5 * voxel, bricks, values};
}

PolygonizeResult meshed(const field::Grid& grid) {
  PolygonizeResult result = polygonize_grid(grid, {.count_components = true});
  const mesh::Audit audit = mesh::validate(result.mesh);
  EXPECT_TRUE(audit.good()) << mesh::summary(audit);
  EXPECT_EQ(result.report.vertices_moved, 0U);
  return result;
}

TEST(PolygonizeGrid, SphereConvergesAtSecondOrder) {
  const Vec3 center(0.013, -0.027, 0.041);
  double last = 0;
  for (const double voxel : {0.1, 0.05, 0.025}) {
    const auto grid = narrow_band([&](const Vec3& p) { return (p - center).norm() - 1; }, voxel, Vec3(0.3, 0.2, 0.1) * voxel,
                                  static_cast<int>(0.25 / voxel) + 1);
    const PolygonizeResult r = meshed(grid);
    const double error = 4 * kPi - mesh::area(r.mesh);
    if (last > 0) EXPECT_NEAR(last / error, 4, 0.5);
    last = error;
    EXPECT_EQ(r.report.components, 1U);
    EXPECT_EQ(r.report.evaluations, 0U);
    const auto normals = std::as_const(r.mesh.attributes).values(attribute::kNormal, 3);
    for (std::size_t v = 0; v < r.mesh.positions.size(); ++v) {
      const Vec3 out = r.mesh.positions[v] - center;
      EXPECT_NEAR(out.norm(), 1, 0.26 * voxel * voxel);  // trilinear interpolation: h²/8 times the Laplacian 2/R
      EXPECT_GT(Vec3(normals[3 * v], normals[3 * v + 1], normals[3 * v + 2]).dot(out.normalized()), 1 - voxel * voxel);
    }
  }
}

// Bricks taken out of the band: the surface ends where they end, and is closed there.
TEST(PolygonizeGrid, TornBandIsClosedWhereItsBricksEnd) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const field::Grid whole = narrow_band([&](const Vec3& p) { return p.norm() - 1; }, 0.05, Vec3(0.01, 0, 0), 4);
    std::vector<field::Coord> bricks;
    std::vector<float> values;
    for (std::size_t b = 0; b < whole.bricks().size(); ++b) {
      if (random_uniform(seed, b, 0)[0] < 0.2) continue;
      bricks.push_back(whole.bricks()[b]);
      values.insert(values.end(), whole.brick(b).begin(), whole.brick(b).end());
    }
    const field::Grid torn(0.05, Vec3::Zero(), 0.25, bricks, values);
    const mesh::Audit audit = mesh::validate(polygonize_grid(torn).mesh);
    EXPECT_TRUE(audit.closed() && audit.manifold() && audit.oriented() && audit.finite()) << mesh::summary(audit);
    EXPECT_GT(audit.triangles, 1000U);
  }
}

// One brick full of noise next to emptiness on every side, inside samples on all of its faces.
TEST(PolygonizeGrid, LoneBricksOfNoiseAreClosed) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    std::vector<float> values;
    for (std::uint64_t n = 0; n < 1024; ++n) {
      const auto r = random_uniform(seed, n, 0);
      // Zeros put vertices of many cells into one lattice point; they have to be parted again.
      values.push_back(seed % 3 == 0 && r[1] < 0.2 ? 0 : static_cast<float>(r[0] - 0.6));
    }
    const field::Grid grid(1, Vec3::Zero(), 3, {{-1, 0, 0}, {0, 1, seed % 2 == 0 ? 0 : 3}}, values);
    const mesh::Mesh mesh = polygonize_grid(grid).mesh;
    const mesh::Audit audit = mesh::validate(mesh);
    ASSERT_TRUE(audit.good()) << mesh::summary(audit);
    // Both bricks are all there: no inside voxel without a surface about it.
    ASSERT_GT(mesh::volume(mesh), 250);
  }
}

TEST(PolygonizeGrid, SameBitsForAnyNumberOfThreads) {
  const auto grid = narrow_band([&](const Vec3& p) { return p.norm() - 1; }, 0.04, Vec3::Zero(), 5);
  const auto run = [&](int threads) {
    return polygonize_grid(grid, {}, RunControl({.threads = threads, .seed = 0, .on_progress = {}})).mesh;
  };
  const mesh::Mesh one = run(1);
  for (const int threads : {2, 3, 5, 8}) {
    const mesh::Mesh other = run(threads);
    EXPECT_EQ(one.positions, other.positions);
    EXPECT_EQ(one.triangles, other.triangles);
    EXPECT_TRUE(
        std::ranges::equal(one.attributes.values(attribute::kNormal, 3), other.attributes.values(attribute::kNormal, 3)));
  }
}

TEST(PolygonizeGrid, ScaleChangesNothingButScale) {
  const auto make = [](double s) {
    return meshed(
        narrow_band([&](const Vec3& p) { return (p - Vec3(0.01, 0.02, 0.03) * s).norm() - s; }, 0.07 * s, Vec3::Zero(), 3));
  };
  const PolygonizeResult one = make(1);
  for (const double s : {0.01, 1000.0}) {
    const PolygonizeResult r = make(s);
    ASSERT_EQ(r.mesh.triangles, one.mesh.triangles);
    for (std::size_t v = 0; v < one.mesh.positions.size(); ++v)
      ASSERT_LT((r.mesh.positions[v] / s - one.mesh.positions[v]).norm(), 1e-6);  // samples are floats
  }
}

TEST(PolygonizeGrid, EmptyAndOneSided) {
  EXPECT_TRUE(polygonize_grid({1, Vec3::Zero(), 3, {}, {}}).mesh.positions.empty());
  EXPECT_TRUE(polygonize_grid({1, Vec3::Zero(), 3, {{0, 0, 0}}, std::vector<float>(512, 1)}).mesh.positions.empty());
  // All inside: closed a quarter of the way to the outer voxels, by values -1 and 3; edges are cut off.
  const PolygonizeResult block = meshed({1, Vec3::Zero(), 3, {{0, 0, 0}}, std::vector<float>(512, -1)});
  EXPECT_LT(mesh::volume(block.mesh), std::pow(7.5, 3));
  EXPECT_GT(mesh::volume(block.mesh), std::pow(7.5, 3) - 12 * 7.5 / 8);
}

}  // namespace
}  // namespace meniscus::polygonize
