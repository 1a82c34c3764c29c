#pragma once

#include <meniscus/field/field.h>
#include <meniscus/field/tape.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace meniscus::field {

/// A field given by a formula in x, y, z, t and named parameters (formula.h has the language), negative inside.
///
/// All derivatives are exact; explicit t and animated parameters give F_t and ∇F_t. Where F has no value (the root of a
/// negative number) it is NaN, where it has no limit (division by zero) it may be infinite; where F is finite, derivatives
/// that do not exist are zero. No material velocity: a formula does not say what moves.
/// Cost: the formula's operations, by packets of points; sin, cos, exp, log, sqrt and arithmetic are vectorised, the other
/// functions cost about 20 ns a point.
class Expression : public Field {
 public:
  /// `bounds`: a box that holds the surface and the inside, when the caller knows one.
  /// Throws FormulaError with the column, or InvalidInput for an improper parameter name.
  explicit Expression(const std::string& formula, std::vector<std::pair<std::string, Number>> parameters = {},
                      std::optional<Box> bounds = {});

  /// The compiled formula, for those who want to know its length.
  const Tape& tape() const { return *tape_; }

  std::unique_ptr<Field> clone() const override { return std::make_unique<Expression>(*this); }
  Interval range(const Box& box) const override;
  /// The caller's box up to level 0; beyond it nothing is known.
  Box bounds_below(double level) const override { return level <= 0 ? bounds_ : Box::everywhere(); }
  bool moving() const override { return tape_->uses_time || slots_.moving(); }

 protected:
  void do_evaluate(const Positions& x, const JetView& out) const override;
  void do_parameter_rows(const Positions& x, SparseRows& rows) const override;
  void do_set_parameters(std::span<const double> values, std::span<const double> rates) override;
  void do_set_time(double t) override;

 private:
  Expression(const std::string& formula, const std::vector<std::string>& names,
             const std::vector<std::pair<std::string, Number>>& parameters, const Box& bounds);
  void run(const Positions& x, const JetView& out, const std::vector<double>& seeds, bool variables) const;
  std::vector<double> values() const;

  std::shared_ptr<const Tape> tape_;
  Slots slots_;
  Box bounds_;
};

}  // namespace meniscus::field
