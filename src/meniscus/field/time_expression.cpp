#include <meniscus/field/time_expression.h>

#include <meniscus/field/formula.h>
#include <meniscus/field/tape_run.h>

namespace meniscus::field {

TimeExpression::TimeExpression(const std::string& formula) : tape_(parse_formula(formula, {}, Variables::Time)) {}

TimeFunction::Sample TimeExpression::at(double t) const {
  const double zero = 0;
  double rows[row_count(Order::GradientTime)];
  run_tape(tape_, {{}, {}, t, true, true}, {&zero, &zero, &zero, 1}, {rows, 1, 1, Order::GradientTime});
  return {rows[kF], rows[kFt]};
}

}  // namespace meniscus::field
