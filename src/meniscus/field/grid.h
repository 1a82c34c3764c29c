#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/vec.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace meniscus::field {

/// Index of a voxel or of a brick.
using Coord = std::array<std::int32_t, 3>;

/// A sparse regular grid of samples: 8³ bricks near a surface, a constant ±background elsewhere.
///
/// Voxel (i, j, k) samples the point origin + voxel * (i, j, k). Bricks are sorted by (x, y, z) of their index; brick b
/// covers voxels 8b … 8b+7 per axis, and within it voxel (i, j, k) is number (i*8 + j)*8 + k: the order of an OpenVDB leaf.
/// Away from bricks the value is ±background. The side is read off the column of bricks with the same (x, y): between two of
/// them the sign of the nearer one's facing sample holds (the lower one's when equally near), elsewhere it is outside. So a
/// closed level set needs no interior bricks, and one that was cut open is closed where its bricks end.
class Grid {
 public:
  static constexpr std::int32_t kBrick = 8;
  static constexpr std::size_t kBrickVoxels = 512;
  /// Number of voxel (i, j, k) in its brick; each index 0 … 7.
  static constexpr std::size_t number(std::int32_t i, std::int32_t j, std::int32_t k) {
    return static_cast<std::size_t>((i * kBrick + j) * kBrick + k);
  }
  /// Index of the brick that holds a voxel.
  static constexpr Coord brick_of(const Coord& ijk) { return {ijk[0] >> 3, ijk[1] >> 3, ijk[2] >> 3}; }

  /// `bricks` in any order, `values` 512 per brick in the same order. Samples that are not finite count as +background.
  /// Throws InvalidInput for a voxel size or background outside [1e-100, 1e100] (background: also beyond float), an origin
  /// that is not finite, a count that does not fit, a brick index beyond ±2^27, or a brick given twice.
  Grid(double voxel, Vec3 origin, double background, std::vector<Coord> bricks, std::vector<float> values);

  double voxel() const { return voxel_; }
  const Vec3& origin() const { return origin_; }
  double background() const { return background_; }  ///< rounded to float
  std::span<const Coord> bricks() const { return bricks_; }
  /// The 512 samples of brick number b.
  std::span<const float> brick(std::size_t b) const { return {values_.data() + b * kBrickVoxels, kBrickVoxels}; }
  /// Number of the brick with that index; bricks().size() when there is none.
  std::size_t find(const Coord& brick_index) const;
  /// Sample at a voxel, ±background where no brick is.
  float value(const Coord& ijk) const { return view(brick_of(ijk)).value(ijk[0] & 7, ijk[1] & 7, ijk[2] & 7); }
  /// World box of all bricks' samples; empty without bricks.
  Box bounds() const;

  /// Samples over one brick's place, whether a brick is there or not.
  struct View {
    const float* samples = nullptr;  ///< the brick's 512 samples; null where no brick is
    const float* column = nullptr;   ///< without a brick: the facing samples that tell the side, stride 8; null = outside
    float background = 0;

    float value(std::int32_t i, std::int32_t j, std::int32_t k) const {
      if (samples) return samples[number(i, j, k)];
      return column && column[number(i, j, 0)] < 0 ? -background : background;
    }
  };
  /// Looks a place up. For many voxels of one brick: the search is done once.
  View view(const Coord& brick_index) const;

 private:
  void sort_bricks();
  void build_index();

  double voxel_;
  Vec3 origin_;
  double background_;
  std::vector<Coord> bricks_;
  std::vector<float> values_;
  std::vector<std::uint32_t> index_;  // open addressing: brick number + 1, or 0 for a free place; size a power of two
};

}  // namespace meniscus::field
