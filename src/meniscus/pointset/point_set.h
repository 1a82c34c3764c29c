#pragma once

#include <meniscus/base/attributes.h>
#include <meniscus/base/vec.h>
#include <meniscus/points/cloud.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace meniscus::pointset {

/// Most control points along an axis of a local grid.
inline constexpr int kMostGrid = 6;

/// Right-handed orthonormal axes of a point's local coordinates; w is its normal.
struct Frame {
  Vec3 u, v, w;
};

/// The frame of a unit normal: a function of the normal alone, so frames need not be stored.
Frame frame_about(const Vec3& normal);

/// All that a point of a PointSet owns. Copied out and put back, it restores every bit.
struct PointRecord {
  Vec3 position, normal, border;
  double reach = 0;
  std::vector<double> coefficients;
};

/// A point-set surface [GHQ03]: n points, each with a unit normal and a small scalar function of its own.
///
/// Point i's function lives in its local coordinates u, v, w = frame · (x − p_i) / reach_i, in [−1, 1]³, as a uniform
/// quadratic B-spline  s_i = Σ_abc P_abc N_a(u) N_b(v) N_c(w), g control points along each axis. Its values are world units,
/// about the signed distance to the surface, negative inside. It counts within the ball of radius reach_i about p_i, the
/// domain. Plain arrays: change them as you like; see PointSetField::refresh.
struct PointSet {
  int grid = 3;                      ///< g, 3 … kMostGrid
  std::vector<double> x, y, z;       ///< positions, world units
  std::vector<double> nx, ny, nz;    ///< unit outward normals
  std::vector<double> bx, by, bz;    ///< border: from the point to where its surface ends, tangential; zero for inner points
  std::vector<double> reach;         ///< radius of the domain, world units, > 0
  std::vector<double> coefficients;  ///< n·g³: P_abc of point i at ((i g + a) g + b) g + c
  Attributes attributes;             ///< what rode on the cloud, n elements each

  std::size_t size() const { return x.size(); }
  bool empty() const { return x.empty(); }
  /// g³.
  std::size_t coefficients_per_point() const;
  Vec3 position(std::size_t i) const { return {x[i], y[i], z[i]}; }
  Vec3 normal(std::size_t i) const { return {nx[i], ny[i], nz[i]}; }
  Vec3 border(std::size_t i) const { return {bx[i], by[i], bz[i]}; }
  void set_position(std::size_t i, const Vec3& p);
  void set_normal(std::size_t i, const Vec3& n);
  void set_border(std::size_t i, const Vec3& b);
  std::span<double> coefficients_of(std::size_t i);
  std::span<const double> coefficients_of(std::size_t i) const;

  /// Makes room for `count` points: new ones are zero throughout.
  void resize(std::size_t count);
  PointRecord record(std::size_t i) const;
  void restore(std::size_t i, const PointRecord& record);
  /// Adds points at the end; `like[k]` is the point whose attributes the k-th takes over.
  void append(std::span<const PointRecord> records, std::span<const std::size_t> like);
  /// Keeps the points `indices`, in that order.
  void keep(std::span<const std::size_t> indices);
  /// Bytes of the arrays above, attributes left out.
  std::size_t bytes() const;
};

/// Regular samples of a local grid stand at ±kSampleExtent · reach along the axes: their corners are on the domain's rim.
inline constexpr double kSampleExtent = 0.5773502691896258;

/// World positions of the g×g×g regular samples of point i's grid; sample (a, b, c) is number (a g + b) g + c, the first at
/// the negative end of u, v and w.
std::vector<Vec3> sample_positions(const PointSet& set, std::size_t i);

/// Sets the coefficients of point i so that s_i takes these values at sample_positions(): a product with the constant
/// inverse A of the basis values along each axis, p = (A⊗A⊗A) d.
void set_samples(PointSet& set, std::size_t i, std::span<const double> values);

/// Bounds on how far s_i departs from point i's tangent plane within its domain: those of its coefficients.
struct Bounds {
  double least, most;
};
Bounds residual_bounds(const PointSet& set, std::size_t i);

/// The points with their normals "N" and attributes.
points::Cloud to_cloud(const PointSet& set);

}  // namespace meniscus::pointset
