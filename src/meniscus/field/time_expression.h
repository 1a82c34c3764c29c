#pragma once

#include <meniscus/field/parameter.h>
#include <meniscus/field/tape.h>

#include <string>

namespace meniscus::field {

/// A number that follows a formula in t (seconds), such as "0.5 + 0.1*sin(2*pi*t)", with its exact rate.
class TimeExpression : public TimeFunction {
 public:
  /// Throws FormulaError with the column.
  explicit TimeExpression(const std::string& formula);
  /// The value may be NaN or infinite where the formula is; the rate is finite where the value is.
  Sample at(double t) const override;

 private:
  Tape tape_;
};

}  // namespace meniscus::field
