#pragma once

#include <meniscus/base/vec.h>
#include <meniscus/field/jets.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace meniscus::sample {

/// Points of a surface with their unit normals, structure of arrays.
struct SurfacePoints {
  std::vector<double> x, y, z;
  std::vector<double> nx, ny, nz;

  std::size_t size() const { return x.size(); }
  bool empty() const { return x.empty(); }
  Vec3 position(std::size_t i) const { return {x[i], y[i], z[i]}; }
  Vec3 normal(std::size_t i) const { return {nx[i], ny[i], nz[i]}; }
  field::Positions positions() const { return {x.data(), y.data(), z.data(), x.size()}; }

  void push_back(const Vec3& position, const Vec3& normal);
  void set_position(std::size_t i, const Vec3& p);
  void set_normal(std::size_t i, const Vec3& n);
  void resize(std::size_t size);
  /// The points `order`, in that order.
  SurfacePoints gathered(std::span<const std::uint32_t> order) const;
};

/// values[order[0]], values[order[1]], …
template <class T>
std::vector<T> gathered(const std::vector<T>& values, std::span<const std::uint32_t> order) {
  std::vector<T> out;
  out.reserve(order.size());
  for (const std::uint32_t i : order) out.push_back(values[i]);
  return out;
}

/// How far a neighbour with normal (bx, by, bz) lies on the same sheet as a particle with normal (ax, ay, az): 1 up to a
/// right angle, so that sharp edges keep their distance, falling to 0 at 120 degrees, so that a thin body's two sides do not
/// feel each other. [THEORY §3, "thin parts"]
inline double same_sheet(double ax, double ay, double az, double bx, double by, double bz) {
  const double w = 1 + 2 * (ax * bx + ay * by + az * bz);
  return w < 0 ? 0 : (w > 1 ? 1 : w);
}
inline double same_sheet(const SurfacePoints& p, std::size_t i, std::size_t j) {
  return same_sheet(p.nx[i], p.ny[i], p.nz[i], p.nx[j], p.ny[j], p.nz[j]);
}

/// Length of the arc over the chord d = b − a between points with unit normals n and m: asin(s)/s, s = |d·(m − n)| / (2|d|)
/// the sine of half the turn towards each other (a twist of the normals about d does not count); to 1 % up to 120°. Along a
/// surface that bends within the spacing, such as the rim of an ear, this times |d| is the distance.
inline double arc_over_chord(const Vec3& d, const Vec3& n, const Vec3& m) {
  const double turn = d.dot(m - n), chord2 = d.squaredNorm();
  if (!(chord2 > 0)) return 1;
  const double s = std::min(1.0, 0.25 * turn * turn / chord2);
  return 1 + s * (1.0 / 6 + s * (3.0 / 40 + s * (5.0 / 112 + s * (35.0 / 1152 + s * 63.0 / 2816))));
}

/// Spacing of the hexagonal lattice with n points on `area`. [THEORY §3]
double hexagonal_spacing(double area, double n);

}  // namespace meniscus::sample
