#pragma once

#include <meniscus/band/band.h>

#include <vector>

namespace meniscus::band {

/// Signed distance to a field's surface anywhere in a box: exact to second order near the surface, where a band knows it;
/// farther away from a coarse dense grid (up to about 80 nodes an axis) by fast sweeping, to a few per cent.
class FarDistance {
 public:
  FarDistance(const field::Field& field, double voxel, const Box& box, const RunControl& run = {});

  /// Distance at a point; beyond the box that of the nearest point of the box.
  double at(const Vec3& x) const;
  /// The surface itself.
  const Band& band() const { return fine_; }

  /// A deepest point of every part of the inside in which no node satisfies `other[node] < 0`; `other` runs over nodes().
  struct Deep {
    Vec3 x;
    double depth;
  };
  std::vector<Deep> untouched(const std::vector<double>& other) const;
  field::PositionBatch nodes() const;

 private:
  std::size_t number(int i, int j, int k) const {
    return (static_cast<std::size_t>(i) * static_cast<std::size_t>(n_[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(n_[2]) +
           static_cast<std::size_t>(k);
  }
  void sweep();

  Band fine_;
  double cell_;
  Vec3 origin_;
  int n_[3];
  std::vector<double> d_;
};

}  // namespace meniscus::band
