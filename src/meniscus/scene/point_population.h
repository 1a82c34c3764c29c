#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/field/field.h>
#include <meniscus/points/cloud.h>

#include <span>

namespace meniscus::scene {

/// Keeps points that are carried along a moving surface spread over it, some `spacing` (world units) apart. New points take
/// the attributes of their nearest old one and stand at the end.
class PointPopulation {
 public:
  /// `surface` as posed at the moment; bounded.
  PointPopulation(const field::Field& surface, double spacing) : surface_(surface), spacing_(spacing) {}

  /// Points spread evenly, without attributes (sample::spread).
  points::Cloud first(const RunControl& run) const;

  /// Lets the points repel each other for a while [WH94 §4], splitting where they are sparse and dying where they are
  /// crowded. Returns how many old ones are left.
  std::size_t redistribute(points::Cloud& cloud, const RunControl& run) const;

  /// Adds a point wherever one of `probes` (places near the surface, closer together than the spacing) is farther than a
  /// spacing from every point.
  void cover(points::Cloud& cloud, std::span<const Vec3> probes, const RunControl& run) const;

 private:
  const field::Field& surface_;
  double spacing_;
};

}  // namespace meniscus::scene
