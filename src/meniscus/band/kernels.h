#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace meniscus::band {

/// A brick's 8³ samples with two more on every side: what the stencils read. A row fills a cache line, so that no load of a
/// stencil straddles two.
inline constexpr int kHaloSide = 12;
inline constexpr int kHaloY = 16;
inline constexpr int kHaloX = kHaloSide * kHaloY;
inline constexpr int kHaloSize = kHaloSide * kHaloX;
/// Place of sample (i, j, k) of the brick itself, -2 <= i, j, k < 10.
constexpr int halo_at(int i, int j, int k) { return (i + 2) * kHaloX + (j + 2) * kHaloY + (k + 4); }
struct alignas(64) Halo {
  float samples[kHaloSize];
  operator float*() { return samples; }
  operator const float*() const { return samples; }
};

/// Where a brick's rows of eight lie; a brick that is not there is one row of constants (stride 0).
struct RowSource {
  const float* first;
  std::size_t stride;
};

/// A bit per node of a brick: plane i, bit 8 j + k.
using NodeBits = std::array<std::uint64_t, 8>;

/// A bit per row of a brick: 8 i + j. What a kernel is told to work on; other rows stay as they are.
using Rows = std::uint64_t;
inline constexpr Rows kAllRows = ~Rows{0};
/// Rows in the order in which they come near to the surface: those within a voxel, two, three, and the others.
using RowLayers = std::array<Rows, 4>;

/// What passes over the bricks need to know before they look at a brick's samples.
struct Outline {
  static constexpr int kSteps = 16;      ///< to a voxel
  static constexpr int kMost = 64;       ///< steps
  NodeBits inside;                       ///< nodes whose sample is below zero
  std::array<std::uint8_t, 64> nearest;  ///< how near each row comes to the surface, in steps, rounded down; at most kMost
};

/// One explicit stage: out = φ + b (previous - φ) + c rate(φ), clamped to ±background, with
/// rate = -V |∇φ| (second-order upwind, Godunov) + tension κ |∇φ| (central differences). THEORY (5.1), (5.2).
struct StepCoefficients {
  float voxel = 1;
  float background = 4;
  float tension = 0;  ///< β, units²/s; 0 leaves the curvature out
  float b = 0, c = 0;
};

/// What a brick's cells hold of the piecewise linear surface, lengths in voxels: its area, ∫ x·n about the brick's first
/// node and ∫ n.
struct SurfacePart {
  float area, flux, normal[3];
};

/// Sums over particles near a group of points; see particle_surface.cpp.
struct ParticleLanes {
  const float* x;  ///< candidates' positions, relative to the group
  const float* y;
  const float* z;
  const float* radius;
  const float* weight;
  const float* metric;  ///< six rows (xx, xy, xz, yy, yz, zz) of `count` numbers: distance² in units of the support
  std::size_t count;
};

/// The innermost loops, one set per processor family; all sets give the same bits.
struct Kernels {
  /// Copies a brick (source[13]) and the rims of its 26 neighbours, numbered as Band::direction(), into a halo.
  void (*gather)(const RowSource* source, float* halo);
  /// The same without what lies across edges and corners: for stencils along the axes.
  void (*gather_star)(const RowSource* source, float* halo);
  /// Copies the brick out of its halo.
  void (*centre)(const float* halo, float* out);
  void (*outline)(const float* samples, float voxel, Outline& out);
  /// The nodes whose sample is nearer to zero than `limit`.
  void (*nearer)(const float* samples, float limit, NodeBits& bits);
  /// `speed` is a halo (NaN: none), `previous` holds 512 numbers; null means none (no transport; b must be 0).
  void (*step)(const float* halo, const float* speed, const float* previous, const StepCoefficients& c, Rows rows,
               float* out);
  /// Carries speeds outwards along ∇φ through rows of a brick, layer by layer: nodes next to the surface keep theirs; every
  /// other node takes the mean of its neighbours nearer to the surface. NaN = not known yet.
  void (*extend)(const float* phi_halo, float* speed_halo, const RowLayers& rows);
  /// Solves the eikonal equation through rows of a brick, layer by layer, second order where two upwind samples exist; nodes
  /// next to the surface stay. Returns the largest change.
  float (*eikonal)(float* halo, float voxel, float background, const RowLayers& rows);
  /// Makes samples next to the surface distances: φ / |∇φ|, at most the distance along an axis crossing; the slope |∇φ| is
  /// the mean over the node and those of its neighbours that are next to the surface too (central differences; at a kink,
  /// where two sheets nearly touch, the side that crosses). The others stay.
  void (*rescale)(const float* halo, float voxel, float* out);
  /// Numbers (as of their first nodes) of a brick's cells that hold both sides of the surface; returns how many.
  std::size_t (*cut_cells)(const float* halo, std::uint16_t* cells);
  /// The surface within some cells of a brick: linear in each of the six tetrahedra around a cell's diagonal. `scale`
  /// multiplies the samples; voxels across a unit sample keep the numbers near one.
  void (*surface_part)(const float* halo, float scale, const std::uint16_t* cells, std::size_t count, SurfacePart& part);
  /// Weighted means at 8 points: out rows: Σw, Σwx, Σwy, Σwz, Σwr; w = weight (1-d²)³ with d² isotropic (metric row 0).
  void (*averaged)(const ParticleLanes& p, const float* x, const float* y, const float* z, float* out);
  /// Sum of blobs at 8 points with gradient: out rows: Σf, its x, y, z derivatives; f = weight (1-d²)³.
  void (*density)(const ParticleLanes& p, const float* x, const float* y, const float* z, float* out);
};

/// The fastest set this processor can run.
const Kernels& kernels();
/// The set every x86-64 processor can run: for tests.
const Kernels& baseline_kernels();

}  // namespace meniscus::band
