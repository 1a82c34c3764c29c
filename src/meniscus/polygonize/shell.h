#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/base/vec.h>
#include <meniscus/field/grid.h>
#include <meniscus/polygonize/cell_cases.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace meniscus::polygonize {

// Index of a brick of 8³ cells, or of a cell or lattice point.
using field::Coord;

inline constexpr int kBrickCells = 8;
inline constexpr int kBrickPoints = 9;  ///< lattice points along a brick's edge
inline constexpr std::size_t kBrickSamples = 729;

/// The lattice that is meshed: point (i, j, k) lies at origin + voxel * (i, j, k). Points on the rim of [low, high] and
/// beyond count as outside, so every surface closes within.
struct Lattice {
  Vec3 origin = Vec3::Zero();
  double voxel = 1;
  Coord low{};
  Coord high{};

  Vec3 point(const Coord& c) const {
    return {origin.x() + voxel * c[0], origin.y() + voxel * c[1], origin.z() + voxel * c[2]};
  }
  /// Whether a brick has a point that is not forced outside.
  bool reaches(const Coord& brick) const;
};

/// Where samples come from.
class Sampler {
 public:
  Sampler() = default;
  Sampler(const Sampler&) = delete;
  Sampler& operator=(const Sampler&) = delete;
  virtual ~Sampler() = default;
  /// F at the 9³ lattice points of each brick, brick after brick; point (i, j, k) of a brick is number (i*9 + j)*9 + k. Must
  /// depend on the lattice point alone, so that bricks agree where they meet. Returns how many points were evaluated.
  /// Called from many threads.
  virtual std::size_t sample(std::span<const Coord> bricks, double* values) const = 0;
};

/// Number of bits set, without the function call that plain x86-64 makes of it.
inline unsigned bit_count(std::uint64_t w) {
  w -= (w >> 1) & 0x5555555555555555U;
  w = (w & 0x3333333333333333U) + ((w >> 2) & 0x3333333333333333U);
  return static_cast<unsigned>((((w + (w >> 4)) & 0x0F0F0F0F0F0F0F0FU) * 0x0101010101010101U) >> 56);
}

inline Vec3 unit_or_zero(const Vec3& g) {
  const double length = g.norm();
  return length > 0 && std::isfinite(length) ? Vec3(g / length) : Vec3(Vec3::Zero());
}

/// A brick that the surface passes through.
struct SurfaceBrick {
  Coord index{};
  std::uint32_t first_cell = 0;
  std::uint32_t first_vertex = 0;
  std::uint16_t cell_count = 0;
  std::uint16_t vertex_count = 0;
  std::array<std::uint64_t, 8> mask{};  ///< bit 8j + k of word i: the surface passes through cell (i, j, k)
  std::array<std::uint16_t, 8> rank{};  ///< cells before word i

  bool has(int i, int j, int k) const { return ((mask[static_cast<std::size_t>(i)] >> (8 * j + k)) & 1) != 0; }
  /// Number of cell (i, j, k), which must be there, in Shell::cells.
  std::size_t cell(int i, int j, int k) const {
    const auto slab = static_cast<std::size_t>(i);
    const std::uint64_t before = mask[slab] & ((std::uint64_t{1} << (8 * j + k)) - 1);
    return first_cell + rank[slab] + bit_count(before);
  }
};

struct SurfaceCell {
  std::uint16_t kind = 0;          ///< number in CellCases
  std::uint16_t first_vertex = 0;  ///< counted from the brick's first
};

/// How a vertex came to its place.
enum class Placed : std::uint8_t {
  Newton,
  Bisected,
  Crease,
  Corner,  ///< where creases meet
};

inline bool is_creased(Placed placed) { return placed == Placed::Crease || placed == Placed::Corner; }

/// The cells that the surface passes through and the mesh vertices in them: one per loop of each cell, plus those of split
/// faces. Everything sorted by brick, then by cell.
struct Shell {
  Lattice lattice;
  std::vector<SurfaceBrick> bricks;
  std::vector<SurfaceCell> cells;
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;   ///< unit; only if asked for
  std::vector<Placed> placed;  ///< by project() and place_on_creases(); empty before
  std::size_t sampled_bricks = 0;
  std::size_t evaluations = 0;  ///< as the sampler counts
  std::size_t nan_samples = 0;  ///< points that several bricks share count for each

  const SurfaceBrick* find(const Coord& brick) const;
};

struct ShellOptions {
  /// Moves vertices onto the trilinear interpolant of their cell's samples and computes normals from it: for samples that
  /// are all there is. Otherwise vertices are means of their loop's edge crossings.
  bool trilinear = false;
  std::size_t max_cells = std::numeric_limits<std::size_t>::max();  ///< sampled ones
};

/// Samples the bricks `candidates` (each once, neighbours best near each other) and all that the surface reaches from there,
/// and finds the surface's cells.
/// Because the surface is followed out of the candidates, a candidate list that misses part of a component costs nothing
/// but time; one that misses a whole component loses it. Same bits for any number of threads.
/// Throws ResourceLimit for more than max_cells or 2³¹ vertices.
Shell build_shell(const Sampler& sampler, const Lattice& lattice, std::vector<Coord> candidates, const ShellOptions& options,
                  const RunControl& run);

/// The cells of vertices [begin, end).
std::vector<Coord> cells_of(const Shell& shell, std::size_t begin, std::size_t end);

/// A vertex of a shell, seen from its cell.
struct VertexPlace {
  Coord cell{};
  Vec3 center = Vec3::Zero();  ///< of the cell, or of the split face
  /// Lattice points of the crossed edges around the vertex, and on which side they are.
  std::vector<Coord> corners;
  std::vector<bool> inside;
};
/// Looks a vertex up; logarithmic cost, for the few that need care.
VertexPlace place_of(const Shell& shell, std::size_t vertex);

}  // namespace meniscus::polygonize
