#pragma once

#include <meniscus/base/box.h>
#include <meniscus/field/field.h>

namespace meniscus::polygonize {

/// A field cut off at a box: max(F, s·b) with b the signed distance past the nearest face plane. The slope s is that of F in
/// the box, roughly, so that neither swamps the other whatever the units of F. NaN stays NaN. Box::everywhere() cuts nothing
/// off.
class ClippedField {
 public:
  ClippedField(const field::Field& field, const Box& box);

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
  double slope_ = 1;
};

}  // namespace meniscus::polygonize
