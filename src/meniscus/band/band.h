#pragma once

#include <meniscus/band/kernels.h>
#include <meniscus/base/run_control.h>
#include <meniscus/field/field.h>
#include <meniscus/field/grid.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace meniscus::band {

using field::Coord;

/// Room for numbers along a band's nodes, kept from use to use so that memory is not asked for anew. Copies are empty.
struct Spare {
  Spare() = default;
  Spare(const Spare&) {}
  Spare& operator=(const Spare&) { return *this; }
  std::vector<float> values;
};

/// A level set kept near its surface: bricks of 8³ samples in world units, negative inside, clamped to ±background; where
/// no brick is, the side (inside or outside) is known. No box: bricks wake as the surface comes and drop as it leaves, so
/// memory follows the surface's area. Layout and order are those of field::Grid (docs/decisions/0006).
class Band {
 public:
  static constexpr std::size_t kBrickNodes = 512;
  /// Distance kept on each side of the surface, in voxels.
  static constexpr double kHalfWidth = 4;

  /// Neighbour number of a direction (dx, dy, dz), each -1, 0 or 1.
  static constexpr std::size_t direction(int dx, int dy, int dz) {
    return static_cast<std::size_t>((dx + 1) * 9 + (dy + 1) * 3 + (dz + 1));
  }
  static constexpr std::int32_t kOutside = -1;  ///< no brick there: all of it lies outside
  static constexpr std::int32_t kInside = -2;   ///< no brick there: all of it lies inside
  using Neighbours = std::array<std::int32_t, 27>;

  /// An empty band. `voxel` > 0; node (i, j, k) lies at origin + voxel (i, j, k).
  explicit Band(double voxel, Vec3 origin = Vec3::Zero());
  /// Takes samples of any function whose zero set is the surface (negative inside), 512 per brick; bricks in any order
  /// must hold every node within two voxels of the surface. Where no brick is, the side is that of the nearest samples.
  /// Samples that are not finite count as outside. Redistance before use unless the samples are distances already. Throws
  /// InvalidInput for counts that do not fit or a brick given twice.
  Band(double voxel, Vec3 origin, const std::vector<Coord>& bricks, const std::vector<float>& values);
  /// From a stored level set: exactly its samples where they are within the background.
  explicit Band(const field::Grid& grid);

  /// The level set as a grid: no sample changes.
  field::Grid grid() const;

  double voxel() const { return voxel_; }
  const Vec3& origin() const { return origin_; }
  float background() const { return background_; }
  std::size_t brick_count() const { return bricks_.size(); }
  bool empty() const { return bricks_.empty(); }
  const std::vector<Coord>& bricks() const { return bricks_; }
  const Neighbours& neighbours(std::size_t brick) const { return neighbours_[brick]; }
  std::span<float> values() { return values_; }
  std::span<const float> values() const { return values_; }
  /// Exchanges the samples for others of the same number.
  void swap_values(std::vector<float>& values) { values_.swap(values); }
  Vec3 position(std::size_t brick, int i, int j, int k) const;
  /// Number of the brick with that index, or -1.
  std::int32_t find(const Coord& brick) const;
  /// Nodes nearer to the surface than the background.
  std::size_t active_nodes() const;

  /// Adds another shape on the same lattice: the smaller of both samples everywhere. Bricks of `other` beyond reach of this
  /// band's bricks must lie outside this surface.
  void unite(const Band& other);
  /// Trilinear sample at a point; clamped beyond the bricks, where `known` is set false.
  double sample(const Vec3& x, bool* known = nullptr) const;

  /// Forgets the samples of bricks that the surface is nowhere near: they become plain inside or outside, and are dropped.
  /// What a band made from raw samples needs before redistancing.
  void keep_surface(const RunControl& run = {});

  /// Wakes the neighbours of every brick that the band has reached and drops bricks that it has left. Returns, for every new
  /// brick, the number of the brick before (-1: woken); empty when nothing changed.
  std::vector<std::int32_t> adapt(const RunControl& run = {});

 private:
  float far_value(const Coord& brick) const;
  void index();
  std::int32_t side(std::size_t brick, std::size_t d) const;
  void link(const RunControl& run);
  void relink(const std::vector<std::int32_t>& map, const RunControl& run);

  double voxel_;
  Vec3 origin_;
  float background_;
  std::vector<Coord> bricks_;
  std::vector<float> values_;
  Spare spare_;  // the samples before the last adapt()
  std::vector<Neighbours> neighbours_;
  std::vector<std::uint32_t> slots_;  // open addressing, brick number + 1
};

/// Unit outward normal by differences of a voxel; zero where the samples are flat.
Vec3 surface_normal(const Band& band, const Vec3& x);

/// Copies the samples of a brick and two more on every side into `halo` from an array that runs along the band's bricks;
/// beyond bricks the value is `outside` or `inside`.
void gather_halo(const Band& band, const float* data, std::size_t brick, float outside, float inside, Halo& halo);

/// The same without what lies across the brick's edges and corners: enough for stencils along the axes. Bricks whose
/// `present` is 0 count as not there (null: all are).
void gather_star(const Band& band, const float* data, std::size_t brick, float outside, float inside, Halo& halo,
                 const char* present = nullptr);

/// The band of any field's surface inside `box` (its own bounds when empty): finds every component whose thickness exceeds
/// about a voxel, by the field's interval range where that can prune. Samples are first-order distances F/|∇F|, then
/// redistanced. Throws InvalidInput for an infinite box, ResourceLimit (with the figure) for more than `max_bricks`.
Band band_of(const field::Field& field, double voxel, const Box& box = {}, std::size_t max_bricks = 1u << 20,
             const RunControl& run = {});

}  // namespace meniscus::band
