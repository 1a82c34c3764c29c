#pragma once

#include <meniscus/field/field.h>
#include <meniscus/field/grid.h>

#include <memory>
#include <vector>

namespace meniscus::field {

/// How a GridField fills the space between samples. Both are sums Σ c_i B(x - i) of B-splines, whose derivatives are exact.
enum class Interpolation {
  /// Degree 1 through the samples. Kinked at voxel faces; second derivatives of the axes are 0. 8 samples per point.
  Trilinear,
  /// Degree 3, twice continuously differentiable everywhere: what velocities and curvature need. The coefficients come from
  /// the samples by the local quasi-interpolant c = (1 - δ²/6) f per axis: exact for cubics, error O(voxel⁴), and at a
  /// sample
  /// it misses the data by only their fourth difference / 36. No global solve, so a sample's influence ends three voxels
  /// away.
  Cubic
};

/// A sampled level set as a field. Constant ±background away from the bricks; no parameters; does not move; always finite.
///
/// Cost: Trilinear 8, Cubic 64 samples a point; neighbouring points in a row share the brick search. Cubic keeps
/// coefficients in memory as large as the grid. range() looks at samples where the box is small, at whole bricks where it is
/// not.
class GridField : public Field {
 public:
  /// Throws InvalidInput for a null grid.
  explicit GridField(std::shared_ptr<const Grid> grid, Interpolation interpolation = Interpolation::Cubic,
                     const RunControl& run = {});

  const std::shared_ptr<const Grid>& grid() const { return grid_; }
  Interpolation interpolation() const { return interpolation_; }

  std::unique_ptr<Field> clone() const override { return std::make_unique<GridField>(*this); }
  Interval range(const Box& box) const override;
  Box bounds_below(double level) const override;
  bool moving() const override { return false; }

 protected:
  void do_evaluate(const Positions& x, const JetView& out) const override;

 private:
  struct Shared;  // what clones have in common: coefficients, and their range per brick

  std::shared_ptr<const Grid> grid_;
  Interpolation interpolation_;
  std::shared_ptr<const Shared> shared_;
};

}  // namespace meniscus::field
