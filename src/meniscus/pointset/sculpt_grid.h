#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/run_control.h>
#include <meniscus/base/vec.h>

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace meniscus::pointset {

/// What a voxel is made of. Forces, masses and springs act on values, which are world units.
struct Material {
  double mass = 1;       ///< > 0; inertia of the value
  double damping = 4;    ///< >= 0, 1/s per unit of mass one: how fast motion dies
  double stiffness = 1;  ///< >= 0, world units² / s²: springs to the six neighbours; waves travel at √(stiffness / mass)
};

/// Throws InvalidInput for a mass that is not above 0, a damping or stiffness below 0, or one that is not finite.
void check(const Material& material);

/// A region of space whose values can be pushed: a lattice of n0×n1×n2 voxels, each with a value d, coupled by springs in
/// value, not in place [GHQ03]:
///
///     M d̈ + D ḋ + K (d − d⁰) = f
///
/// K is the Laplacian of the lattice with the springs' stiffness, d⁰ the values at the start, f the load. The outermost
/// voxels and those that are held stay at d⁰, so what is outside joins on. Voxel (i, j, k) stands at origin + voxel·(i, j,
/// k) and is number (i n1 + j) n2 + k.
class SculptGrid {
 public:
  /// A lattice over `region` with `voxels` along its longest side (4 … 512; the others follow) of one material.
  /// Throws InvalidInput for an empty or unbounded region or a material without meaning, ResourceLimit beyond 2^27 voxels.
  SculptGrid(const Box& region, int voxels, const Material& material);

  std::array<int, 3> count() const { return count_; }
  std::size_t size() const { return base_.size(); }
  double voxel() const { return voxel_; }
  Vec3 position(std::size_t number) const;
  Box bounds() const;

  /// d⁰, world units, as many as voxels: the field's values before anything moves.
  std::span<const float> base() const { return base_; }
  void set_base(std::span<const double> values);
  /// Moves the present state into the values at rest: springs slacken, motion goes on.
  void settle();
  /// Another material in one voxel. Throws InvalidInput like the constructor.
  void set_material(std::size_t number, const Material& material);
  /// The voxel keeps its value.
  void hold(std::size_t number) { free_[number] = 0; }

  /// f, the load on each voxel in world units / s² per unit of mass: pushes values up, so a negative load pulls the surface
  /// outwards. Zero at the start.
  std::span<float> load() { return load_; }
  /// d, d − d⁰ and ḋ.
  std::span<const float> value() const { return value_; }
  std::span<const float> deviation() const { return deviation_; }
  std::span<const float> rate() const { return rate_; }
  /// Multiplies load, deviation and rate: the system is linear, so that is what a load so much greater would have done.
  void scale(double factor);
  /// Back to d⁰ and rest; load, base and material stay.
  void reset();

  /// One implicit (backward Euler) step of `seconds`, solved by conjugate gradients from zero until the residual is below
  /// `tolerance` of the right side or after `most` iterations. Without load the energy never rises, whatever the step, the
  /// stiffness or `most`: each iterate of conjugate gradients is the minimiser in a space that holds itself, which is all
  /// the proof needs. Returns the iterations. Throws InvalidInput for a step that is not positive and finite. Same bits for
  /// any number of threads.
  int step(double seconds, const RunControl& run = {}, double tolerance = 1e-3, int most = 200);
  /// ½ ḋᵀMḋ + ½ (d−d⁰)ᵀK(d−d⁰), of all voxels, per voxel volume.
  double energy() const;

  /// Where a place lies among the voxels: the lower corner of its cell and the share of the way to the upper one.
  struct Cell {
    std::size_t corner;
    std::array<float, 3> share;
  };
  /// The cell of a place; places outside are moved to the nearest one on the lattice.
  Cell cell(const Vec3& place) const;
  /// Trilinear interpolation of any of the arrays above.
  double at(const Cell& cell, std::span<const float> values) const {
    const float* v = values.data() + cell.corner;
    const auto row = static_cast<std::size_t>(count_[2]);
    const float b = cell.share[1], c = cell.share[2];
    const auto along = [&](const float* p) { return p[0] + c * (p[1] - p[0]); };
    const float low0 = along(v), low1 = along(v + row), high0 = along(v + slab_), high1 = along(v + slab_ + row);
    const float low = low0 + b * (low1 - low0), high = high0 + b * (high1 - high0);
    return static_cast<double>(low + cell.share[0] * (high - low));
  }

 private:
  void prepare(double seconds);
  double apply(std::size_t slab, const float* x, float* out) const;

  std::array<int, 3> count_{};
  std::size_t slab_ = 0;  // voxels of one index i: the unit of parallel work
  double voxel_ = 0, per_voxel_ = 0;
  Vec3 origin_ = Vec3::Zero();
  std::vector<float> base_, value_, deviation_, rate_, load_, mass_, damping_, stiffness_, free_;
  std::vector<float> diagonal_, springs_[3];  // of the step's matrix; springs_[a] joins a voxel to the next along axis a
  double prepared_ = 0;                       // the step they are for; 0 = none
  std::vector<float> residual_, direction_, image_, solution_;
};

}  // namespace meniscus::pointset
