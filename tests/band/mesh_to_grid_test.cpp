#include <meniscus/band/mesh_to_grid.h>

#include <meniscus/base/error.h>
#include <meniscus/field/grid_field.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

namespace meniscus::band {
namespace {

/// An octahedron split `levels` times, on the sphere of radius r about c.
mesh::Mesh sphere(double r, const Vec3& c, int levels) {
  mesh::Mesh m;
  m.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  m.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int l = 0; l < levels; ++l) {
    std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> middles;
    const auto middle = [&](std::int32_t a, std::int32_t b) {
      const auto [at, fresh] = middles.try_emplace(std::minmax(a, b), static_cast<std::int32_t>(m.positions.size()));
      if (fresh)
        m.positions.push_back(
            (m.positions[static_cast<std::size_t>(a)] + m.positions[static_cast<std::size_t>(b)]).normalized());
      return at->second;
    };
    std::vector<Triangle> split;
    for (const Triangle& t : m.triangles) {
      const std::int32_t ab = middle(t[0], t[1]), bc = middle(t[1], t[2]), ca = middle(t[2], t[0]);
      split.insert(split.end(), {{t[0], ab, ca}, {t[1], bc, ab}, {t[2], ca, bc}, {ab, bc, ca}});
    }
    m.triangles = std::move(split);
  }
  for (Vec3& p : m.positions) p = c + r * p;
  return m;
}

/// A cube of half-width r about c: its distance is known exactly.
mesh::Mesh cube(double r, const Vec3& c) {
  mesh::Mesh m;
  for (const double z : {-r, r})
    for (const double y : {-r, r})
      for (const double x : {-r, r}) m.positions.push_back(c + Vec3(x, y, z));
  m.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                 {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return m;
}

double cube_distance(const Vec3& x, double r) {
  const Vec3 q = x.cwiseAbs() - Vec3::Constant(r);
  return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0);
}

template <class Visit>
void for_each_sample(const field::Grid& grid, const Visit& visit) {
  for (std::size_t b = 0; b < grid.bricks().size(); ++b)
    for (int n = 0; n < 512; ++n) {
      const auto& c = grid.bricks()[b];
      const Vec3 ijk(8 * c[0] + n / 64, 8 * c[1] + n / 8 % 8, 8 * c[2] + n % 8);
      visit(Vec3(grid.origin() + grid.voxel() * ijk), static_cast<double>(grid.brick(b)[static_cast<std::size_t>(n)]));
    }
}

TEST(MeshToGrid, DistancesToACubeAreExactAtAnyScaleAndPlace) {
  for (const double scale : {0.01, 1.0, 1000.0}) {
    const Vec3 center = scale * Vec3(100.3, -20.1, 7.77);
    const double voxel = 0.05 * scale, r = 0.51 * scale;
    const field::Grid grid = mesh_to_grid(cube(r, center), {.voxel = voxel, .half_width = 4});
    EXPECT_NEAR(grid.background(), 4 * voxel, 1e-6 * voxel);
    double worst = 0;
    std::size_t in_band = 0;
    for_each_sample(grid, [&](const Vec3& x, double v) {
      const double exact = cube_distance(x - center, r);
      worst = std::max(worst, std::abs(v - std::clamp(exact, -grid.background(), grid.background())));
      if (std::abs(exact) < grid.background()) ++in_band;
    });
    EXPECT_LT(worst, 1e-6 * voxel);
    EXPECT_GT(in_band, 10'000u);
  }
}

TEST(MeshToGrid, EverySampleOfTheBandIsThere) {
  const double r = 0.51;
  const field::Grid grid = mesh_to_grid(cube(r, Vec3::Zero()), {.voxel = 0.05, .half_width = 4});
  for (std::int32_t i = -20; i <= 20; ++i)
    for (std::int32_t j = -20; j <= 20; ++j)
      for (std::int32_t k = -20; k <= 20; ++k) {
        const Vec3 x = grid.origin() + grid.voxel() * Vec3(i, j, k);
        EXPECT_NEAR(grid.value({i, j, k}), std::clamp(cube_distance(x, r), -0.2, 0.2), 1e-7);
      }
}

TEST(MeshToGrid, SamplesNextToTheSurfaceAreOnTheRightSide) {
  const double voxel = 0.04;
  const field::Grid grid = mesh_to_grid(sphere(1, Vec3(0.003, 0.001, -0.002), 7), {.voxel = voxel});
  std::size_t next = 0;
  for_each_sample(grid, [&](const Vec3& x, double v) {
    const double exact = (x - Vec3(0.003, 0.001, -0.002)).norm() - 1;
    if (std::abs(exact) < 0.05 * voxel) ++next;
    if (std::abs(exact) < 4.5 * voxel) {
      EXPECT_NEAR(v, exact, 1e-4);
    }  // the mesh's own sag
  });
  EXPECT_GT(next, 300u);
}

TEST(MeshToGrid, FieldOfASphereMeshIsNearItsDistance) {
  const double voxel = 0.04;
  const auto grid = std::make_shared<const field::Grid>(mesh_to_grid(sphere(1, Vec3::Zero(), 6), {.voxel = voxel}));
  const field::GridField field(grid);
  std::vector<Vec3> points;
  for (int n = 0; n < 2000; ++n) {  // a spiral over the sphere
    const double z = 1 - (2 * n + 1) / 2000.0, phi = 2.399963 * n;
    points.emplace_back(std::sqrt(1 - z * z) * std::cos(phi), std::sqrt(1 - z * z) * std::sin(phi), z);
  }
  const field::JetBatch jets = evaluate(field, points, field::Order::Hessian);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(jets.value(i), 0, 4e-4);                     // the mesh lies up to 3e-4 inside the sphere
    EXPECT_LT((jets.gradient(i) - points[i]).norm(), 0.02);  // facets turn by 0.025 from one to the next
  }
  EXPECT_EQ(value_at(field, Vec3::Zero()), -grid->background());
  EXPECT_EQ(value_at(field, {3, 0, 0}), grid->background());
}

TEST(MeshToGrid, TheSignDoesNotDependOnOrientation) {
  mesh::Mesh flipped = cube(1, Vec3::Zero());
  for (Triangle& t : flipped.triangles) std::swap(t[0], t[1]);
  const field::Grid grid = mesh_to_grid(flipped, {.voxel = 0.1});
  EXPECT_LT(grid.value({0, 0, 0}), 0);
  EXPECT_GT(grid.value({20, 0, 0}), 0);
}

TEST(MeshToGrid, SameBitsForAnyThreadCount) {
  const mesh::Mesh m = sphere(1, Vec3(0.1, 0.2, 0.3), 4);
  const auto with = [&](int threads) {
    return mesh_to_grid(m, {.voxel = 0.06}, RunControl({.threads = threads, .seed = 0, .on_progress = {}}));
  };
  const field::Grid one = with(1);
  for (const int threads : {2, 3, 5, 8}) {
    const field::Grid many = with(threads);
    ASSERT_TRUE(std::equal(one.bricks().begin(), one.bricks().end(), many.bricks().begin(), many.bricks().end()));
    for (std::size_t b = 0; b < one.bricks().size(); ++b)
      ASSERT_EQ(std::memcmp(one.brick(b).data(), many.brick(b).data(), 2048), 0);
  }
}

template <class Exception>
std::string message_of(const mesh::Mesh& m, const MeshToGridOptions& options) {
  try {
    mesh_to_grid(m, options);
  } catch (const Exception& e) {
    return e.what();
  }
  return {};
}

TEST(MeshToGrid, SaysWhatIsWrongWithAMesh) {
  mesh::Mesh open = cube(1, Vec3::Zero());
  open.triangles.pop_back();
  EXPECT_NE(message_of<InvalidInput>(open, {.voxel = 0.1}).find("3 edges"), std::string::npos);
  EXPECT_NE(message_of<InvalidInput>({}, {.voxel = 0.1}).find("no triangles"), std::string::npos);
  mesh::Mesh bad = cube(1, Vec3::Zero());
  bad.positions[3].y() = std::nan("");
  EXPECT_NE(message_of<InvalidInput>(bad, {.voxel = 0.1}).find("not finite"), std::string::npos);
  bad = cube(1, Vec3::Zero());
  bad.triangles[0][1] = 8;
  EXPECT_NE(message_of<InvalidInput>(bad, {.voxel = 0.1}).find("do not exist"), std::string::npos);
  EXPECT_NE(message_of<InvalidInput>(cube(0.04, Vec3::Constant(0.05)), {.voxel = 0.1}).find("smaller voxel"),
            std::string::npos);
}

TEST(MeshToGrid, RejectsOptionsOutOfRange) {
  const mesh::Mesh m = cube(1, Vec3::Zero());
  for (const double bad : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    EXPECT_THROW(mesh_to_grid(m, {.voxel = bad}), InvalidInput);
    EXPECT_THROW(mesh_to_grid(m, {.voxel = 0.1, .half_width = bad}), InvalidInput);
  }
}

TEST(MeshToGrid, RefusesVoxelsThatMemoryCannotHold) {
  const mesh::Mesh m = cube(1, Vec3::Zero());
  EXPECT_NE(message_of<ResourceLimit>(m, {.voxel = 1e-5}).find("MB"), std::string::npos);
  EXPECT_THROW(mesh_to_grid(m, {.voxel = 1e-300}), ResourceLimit);
  EXPECT_THROW(mesh_to_grid(m, {.voxel = 0.01, .max_bytes = 1'000'000}), ResourceLimit);
}

TEST(MeshToGrid, TheEstimateHoldsTheResult) {
  const mesh::Mesh m = sphere(1, Vec3::Zero(), 4);
  for (const double voxel : {0.2, 0.05, 0.02}) {
    const field::Grid grid = mesh_to_grid(m, {.voxel = voxel});
    const double bytes = estimated_bytes(m, {.voxel = voxel});
    const double bricks = static_cast<double>(grid.bricks().size());
    EXPECT_GT(bytes, bricks * 2048 * 2);
    EXPECT_LT(bytes, bricks * 2048 * 20);
  }
}

TEST(MeshToGrid, CanBeCancelled) {
  const RunControl run;
  run.cancel();
  EXPECT_THROW(mesh_to_grid(cube(1, Vec3::Zero()), {.voxel = 0.1}, run), Cancelled);
}

}  // namespace
}  // namespace meniscus::band
