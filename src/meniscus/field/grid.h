#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/vec.h>

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

namespace meniscus::field {

/// Index of a voxel or of a brick.
using Coord = std::array<std::int32_t, 3>;

/// A sparse regular grid of samples: 8³ bricks near a surface, a constant ±background elsewhere.
/// Voxel (i, j, k) samples the point origin + voxel * (i, j, k). Bricks are sorted by (x, y, z) of their index; brick b
/// covers voxels 8b … 8b+7 per axis, and within it voxel (i, j, k) is number (i*8 + j)*8 + k: the order of an OpenVDB leaf.
/// Away from bricks the value is -background if the voxel lies inside, +background outside; the side is read off the nearest
/// brick of the same column, so a closed level set needs no interior bricks.
class Grid {
 public:
  static constexpr std::int32_t kBrick = 8;
  static constexpr std::size_t kBrickVoxels = 512;

  /// `bricks` in any order, `values` 512 per brick in the same order. Throws InvalidInput for a voxel size or background
  /// that is not positive and finite, a count that does not fit, or a brick given twice. NaN samples count as +background.
  Grid(double voxel, Vec3 origin, double background, std::vector<Coord> bricks, std::vector<float> values);

  double voxel() const { return voxel_; }
  const Vec3& origin() const { return origin_; }
  double background() const { return background_; }
  std::span<const Coord> bricks() const { return bricks_; }
  /// The 512 samples of brick number b.
  std::span<const float> brick(std::size_t b) const { return {values_.data() + b * kBrickVoxels, kBrickVoxels}; }
  /// Number of the brick with that index; bricks().size() when there is none.
  std::size_t find(const Coord& brick_index) const;
  /// Sample at a voxel, background where no brick is.
  float value(const Coord& ijk) const;
  /// World box of all bricks' samples; empty without bricks.
  Box bounds() const;

 private:
  float outside_value(const Coord& ijk) const;

  double voxel_;
  Vec3 origin_;
  double background_;
  std::vector<Coord> bricks_;
  std::vector<float> values_;
  std::unordered_map<std::uint64_t, std::uint32_t> index_;
};

}  // namespace meniscus::field
