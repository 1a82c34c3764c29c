#include <meniscus/band/vdb_grid.h>

#include <meniscus/base/error.h>

#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace meniscus::band {

namespace {

constexpr openvdb::Index64 kMostTileVoxels = openvdb::Index64{1} << 28;

openvdb::Coord voxel_of(const field::Coord& brick) {
  return {brick[0] * field::Grid::kBrick, brick[1] * field::Grid::kBrick, brick[2] * field::Grid::kBrick};
}

void copy_bricks(const field::Grid& grid, openvdb::FloatTree& tree) {
  openvdb::FloatGrid::Accessor accessor(tree);
  for (std::size_t b = 0; b < grid.bricks().size(); ++b) {
    auto* leaf = accessor.touchLeaf(voxel_of(grid.bricks()[b]));
    const std::span<const float> values = grid.brick(b);
    std::copy(values.begin(), values.end(), leaf->buffer().data());
    for (openvdb::Index n = 0; n < values.size(); ++n)
      leaf->setActiveState(n, std::abs(values[n]) < static_cast<float>(grid.background()));
  }
}

/// The size of cubic voxels along the axes.
double voxel_size(const openvdb::math::Transform& transform) {
  const openvdb::math::Mat4d m =
      transform.isLinear() ? transform.baseMap()->getAffineMap()->getMat4() : openvdb::math::Mat4d::zero();
  const double size = m[0][0];
  bool cubes = size > 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) cubes = cubes && std::abs(m[i][j] - (i == j ? size : 0)) <= 1e-9 * size;
  if (!cubes) throw InvalidInput("VDB grid: only cubic voxels along the axes are supported; resample the grid first");
  return size;
}

}  // namespace

openvdb::FloatGrid::Ptr to_vdb(const field::Grid& grid) {
  auto result = openvdb::FloatGrid::create(static_cast<float>(grid.background()));
  const auto transform = openvdb::math::Transform::createLinearTransform(grid.voxel());
  transform->postTranslate(openvdb::Vec3d(grid.origin().data()));
  result->setTransform(transform);
  result->setGridClass(openvdb::GRID_LEVEL_SET);
  copy_bricks(grid, result->tree());
  openvdb::tools::signedFloodFill(result->tree());
  copy_bricks(grid, result->tree());  // filling also touches inactive voxels of leaves
  return result;
}

field::Grid from_vdb(const openvdb::FloatGrid& grid) {
  const double voxel = voxel_size(grid.transform());
  const openvdb::Vec3d origin = grid.transform().indexToWorld(openvdb::Vec3d(0.0));
  auto tree = grid.treePtr();
  if (tree->activeTileCount() > 0) {
    const auto voxels = tree->activeVoxelCount() - tree->activeLeafVoxelCount();
    if (voxels > kMostTileVoxels)
      throw ResourceLimit("VDB grid: its active tiles hold " + std::to_string(voxels) + " voxels, more than the " +
                          std::to_string(kMostTileVoxels) + " that are allowed");
    openvdb::FloatTree::Ptr dense(new openvdb::FloatTree(*tree));
    dense->voxelizeActiveTiles();
    tree = dense;
  }

  std::vector<field::Coord> bricks;
  std::vector<float> values;
  bricks.reserve(tree->leafCount());
  values.reserve(tree->leafCount() * field::Grid::kBrickVoxels);
  for (auto leaf = tree->cbeginLeaf(); leaf; ++leaf) {
    const openvdb::Coord at = leaf->origin();
    bricks.push_back({at.x() >> 3, at.y() >> 3, at.z() >> 3});
    const float* data = leaf->buffer().data();
    values.insert(values.end(), data, data + field::Grid::kBrickVoxels);
  }
  return {voxel, Vec3(origin.x(), origin.y(), origin.z()), tree->background(), std::move(bricks), std::move(values)};
}

}  // namespace meniscus::band
