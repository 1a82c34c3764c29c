#pragma once

#include <meniscus/field/field.h>

#include <atomic>
#include <functional>
#include <memory>

namespace meniscus::polygonize {

/// A field for tests: a formula, central differences for its gradient, and bounds as told. Counts evaluations.
class FormulaField : public field::Field {
 public:
  using Formula = std::function<double(const Vec3&)>;
  using Range = std::function<field::Interval(const Box&)>;

  FormulaField(Formula f, const Box& bounds, double step = 1e-6, Range range = {})
      : f_(std::move(f)), bounds_(bounds), step_(step), range_(std::move(range)) {}

  std::unique_ptr<Field> clone() const override { return std::make_unique<FormulaField>(f_, bounds_, step_, range_); }
  field::Interval range(const Box& box) const override { return range_ ? range_(box) : field::Interval::everything(); }
  Box bounds_below(double) const override { return bounds_; }
  bool moving() const override { return false; }
  std::size_t evaluations() const { return evaluations_; }

 protected:
  void do_evaluate(const field::Positions& x, const field::JetView& out) const override {
    evaluations_ += x.size;
    for (std::size_t i = 0; i < x.size; ++i) {
      out.rows[i] = f_(x[i]);
      if (!field::has_gradient(out.order)) continue;
      for (int a = 0; a < 3; ++a) {
        const Vec3 h = step_ * Vec3::Unit(a);
        out.row(field::kFx + static_cast<std::size_t>(a))[i] = (f_(x[i] + h) - f_(x[i] - h)) / (2 * step_);
      }
    }
  }

 private:
  Formula f_;
  Box bounds_;
  double step_;
  Range range_;
  mutable std::atomic<std::size_t> evaluations_{0};
};

}  // namespace meniscus::polygonize
