#pragma once

#include <meniscus/base/vec.h>

#include <algorithm>
#include <limits>

namespace meniscus {

/// Axis-aligned box; the default one is empty (min = +inf, max = -inf). Bounds may be infinite.
struct Box {
  Vec3 min = Vec3::Constant(std::numeric_limits<double>::infinity());
  Vec3 max = Vec3::Constant(-std::numeric_limits<double>::infinity());

  /// The box of all space.
  static Box everywhere() { return {-Box{}.min, -Box{}.max}; }
  /// The cube of half-width `radius` about `center`.
  static Box around(const Vec3& center, double radius) {
    return {center - Vec3::Constant(radius), center + Vec3::Constant(radius)};
  }

  bool empty() const { return !(min.array() <= max.array()).all(); }
  bool finite() const { return min.allFinite() && max.allFinite(); }
  Vec3 size() const { return empty() ? Vec3(Vec3::Zero()) : Vec3(max - min); }
  Vec3 center() const { return 0.5 * (min + max); }
  /// Length of the diagonal; 0 when empty.
  double diameter() const { return size().norm(); }

  /// Boundary points count as inside.
  bool contains(const Vec3& p) const { return (p.array() >= min.array()).all() && (p.array() <= max.array()).all(); }
  bool overlaps(const Box& other) const {
    return (other.min.array() <= max.array()).all() && (other.max.array() >= min.array()).all();
  }

  void extend(const Vec3& p) {
    min = min.cwiseMin(p);
    max = max.cwiseMax(p);
  }
  void extend(const Box& other) {
    min = min.cwiseMin(other.min);
    max = max.cwiseMax(other.max);
  }
  /// Grown by `margin` on every side; an empty box stays empty.
  Box padded(double margin) const {
    return empty() ? *this : Box{min - Vec3::Constant(margin), max + Vec3::Constant(margin)};
  }
  Box intersection(const Box& other) const { return {min.cwiseMax(other.min), max.cwiseMin(other.max)}; }
};

}  // namespace meniscus
