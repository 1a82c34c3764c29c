#pragma once

#include <meniscus/base/box.h>
#include <meniscus/field/field.h>

namespace meniscus::polygonize {

/// A field cut off at a box: max(F, b) with b the signed distance past the nearest face plane. NaN counts as outside.
class ClippedField {
 public:
  ClippedField(const field::Field& field, const Box& box) : field_(field), box_(box) {}

  /// F, and ∇F where `out.order` asks for it.
  void evaluate(const field::Positions& x, const field::JetView& out) const;
  field::Interval range(const Box& box) const;
  /// b at p: not negative outside the box.
  double past_box(const Vec3& p) const { return (box_.min - p).cwiseMax(p - box_.max).maxCoeff(); }
  const Box& box() const { return box_; }

 private:
  void clip_gradients(const field::Positions& x, const field::JetView& out) const;

  const field::Field& field_;
  Box box_;
};

}  // namespace meniscus::polygonize
