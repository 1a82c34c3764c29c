#include <meniscus/band/mesh_to_grid.h>
#include <meniscus/band/vdb_grid.h>

#include <meniscus/base/error.h>

#include <gtest/gtest.h>

#include <cstring>

namespace meniscus::band {
namespace {

/// A shell of bricks about a hollow: -1 inside of the ring, +1 outside.
field::Grid hollow() {
  std::vector<field::Coord> bricks;
  std::vector<float> values;
  for (std::int32_t a = -3; a <= 3; ++a)
    for (std::int32_t b = -3; b <= 3; ++b)
      for (std::int32_t c = -3; c <= 3; ++c) {
        if (std::max({std::abs(a), std::abs(b), std::abs(c)}) < 2) continue;
        bricks.push_back({a, b, c});
        for (int n = 0; n < 512; ++n) {
          const Vec3 x(8 * a + n / 64, 8 * b + n / 8 % 8, 8 * c + n % 8);
          values.push_back(static_cast<float>(std::clamp(0.1 * (x.cwiseAbs().maxCoeff() - 20.0), -0.3, 0.3)));
        }
      }
  return {0.1, Vec3(0.03, -5, 7), 0.3, std::move(bricks), std::move(values)};
}

TEST(VdbGrid, ThereAndBackKeepsEveryBit) {
  const field::Grid grid = hollow(), back = from_vdb(*to_vdb(grid));
  EXPECT_EQ(back.voxel(), grid.voxel());
  EXPECT_EQ(back.origin(), grid.origin());
  EXPECT_EQ(back.background(), grid.background());
  ASSERT_TRUE(std::equal(grid.bricks().begin(), grid.bricks().end(), back.bricks().begin(), back.bricks().end()));
  for (std::size_t b = 0; b < grid.bricks().size(); ++b)
    EXPECT_EQ(std::memcmp(grid.brick(b).data(), back.brick(b).data(), 2048), 0);
}

TEST(VdbGrid, OtherProgramsSeeTheSameSamplesAndSides) {
  const field::Grid grid = hollow();
  const auto vdb = to_vdb(grid);
  EXPECT_EQ(vdb->getGridClass(), openvdb::GRID_LEVEL_SET);
  const auto accessor = vdb->getConstAccessor();
  for (std::int32_t i = -40; i <= 40; i += 3)
    for (std::int32_t j = -40; j <= 40; j += 3)
      for (std::int32_t k = -40; k <= 40; ++k) EXPECT_EQ(accessor.getValue({i, j, k}), grid.value({i, j, k}));
  const openvdb::Vec3d p = vdb->indexToWorld(openvdb::Coord(1, 2, 3));
  EXPECT_LT((Vec3(p.x(), p.y(), p.z()) - (grid.origin() + grid.voxel() * Vec3(1, 2, 3))).norm(), 1e-12);
}

TEST(VdbGrid, ActiveTilesBecomeBricks) {
  const auto vdb = openvdb::FloatGrid::create(1);
  vdb->fill(openvdb::CoordBBox(0, 0, 0, 127, 7, 7), 0.5f);
  const field::Grid grid = from_vdb(*vdb);
  EXPECT_EQ(grid.bricks().size(), 16u);
  EXPECT_EQ(grid.value({100, 3, 3}), 0.5f);
}

TEST(VdbGrid, RefusesWhatItCannotHold) {
  const auto stretched = openvdb::FloatGrid::create(1);
  stretched->transform().postScale(openvdb::Vec3d(1, 2, 1));
  EXPECT_THROW(from_vdb(*stretched), InvalidInput);
  const auto turned = openvdb::FloatGrid::create(1);
  turned->transform().postRotate(0.3, openvdb::math::X_AXIS);
  EXPECT_THROW(from_vdb(*turned), InvalidInput);
  EXPECT_THROW(from_vdb(*openvdb::FloatGrid::create(0)), InvalidInput);
  const auto huge = openvdb::FloatGrid::create(1);
  huge->sparseFill(openvdb::CoordBBox(0, 0, 0, 4095, 4095, 4095), 0.5f);
  EXPECT_THROW(from_vdb(*huge), ResourceLimit);
}

}  // namespace
}  // namespace meniscus::band
