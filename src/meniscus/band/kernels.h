#pragma once

#include <cstddef>

namespace meniscus::band {

/// A brick's 8³ samples with two more on every side, rows padded to 16: what the stencils read.
inline constexpr int kHaloSide = 12;
inline constexpr int kHaloY = 16;
inline constexpr int kHaloX = kHaloSide * kHaloY;
inline constexpr int kHaloSize = kHaloSide * kHaloX + 16;
/// Place of sample (i, j, k) of the brick itself, -2 <= i, j, k < 10.
constexpr int halo_at(int i, int j, int k) { return (i + 2) * kHaloX + (j + 2) * kHaloY + (k + 2); }

/// One explicit stage: out = φ + b (previous - φ) + c rate(φ), clamped to ±background, with
/// rate = -V |∇φ| (second-order upwind, Godunov) + tension κ |∇φ| (central differences). THEORY (5.1), (5.2).
struct StepCoefficients {
  float voxel = 1;
  float background = 4;
  float tension = 0;  ///< β, units²/s; 0 leaves the curvature out
  float b = 0, c = 0;
};

/// Sums over particles near a group of points; see particle_target.cpp.
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
  /// `speed` and `previous` hold 512 numbers each; null means none (no transport; b must be 0).
  void (*step)(const float* halo, const float* speed, const float* previous, const StepCoefficients& c, float* out);
  /// Carries speeds outwards along ∇φ: nodes next to the surface keep theirs; every other node takes the mean of its
  /// neighbours nearer to the surface. NaN = not known yet.
  void (*extend)(const float* phi_halo, const float* speed_halo, float* out);
  /// One Jacobi pass of the eikonal equation, second order where two upwind samples exist; nodes next to the surface stay.
  /// Returns the largest change.
  float (*eikonal)(const float* halo, float voxel, float background, float* out);
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
