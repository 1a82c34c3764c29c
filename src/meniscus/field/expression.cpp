#include <meniscus/field/expression.h>

#include <meniscus/field/formula.h>
#include <meniscus/field/tape_run.h>

#include <cmath>

namespace meniscus::field {

namespace {

using NamedNumbers = std::vector<std::pair<std::string, Number>>;

std::vector<std::string> names_of(const NamedNumbers& parameters) {
  std::vector<std::string> names;
  for (const auto& [name, number] : parameters) names.push_back(name);
  return names;
}

constexpr SlotInfo kSlot{"parameter", Quantity::Number};

}  // namespace

Expression::Expression(const std::string& formula, NamedNumbers parameters, std::optional<Box> bounds)
    : Expression(formula, names_of(parameters), parameters, bounds.value_or(Box::everywhere())) {}

Expression::Expression(const std::string& formula, const std::vector<std::string>& names, const NamedNumbers& parameters,
                       const Box& bounds)
    : tape_(std::make_shared<const Tape>(parse_formula(formula, names))),
      slots_(std::vector<SlotInfo>(names.size(), kSlot), 1),
      bounds_(bounds) {
  for (std::size_t s = 0; s < names.size(); ++s) slots_.bind(0, s, parameters[s].second, names[s]);
  parameters_ = slots_.parameters();
}

std::vector<double> Expression::values() const {
  std::vector<double> values(slots_.slots());
  for (std::size_t s = 0; s < values.size(); ++s) values[s] = slots_.value(0, s);
  return values;
}

void Expression::run(const Positions& x, const JetView& out, const std::vector<double>& seeds, bool variables) const {
  const std::vector<double> q = values();
  run_tape(*tape_, {q, seeds, time(), variables, !variables || moving()}, x, out);
}

void Expression::do_evaluate(const Positions& x, const JetView& out) const {
  std::vector<double> seeds(4 * slots_.slots());
  for (std::size_t s = 0; s < slots_.slots(); ++s) seeds[4 * s + 3] = slots_.rate(0, s);
  run(x, out, seeds, true);
}

void Expression::do_parameter_rows(const Positions& x, SparseRows& rows) const {
  // Four parameters at a time stand in for the four variables.
  std::vector<std::pair<std::size_t, std::uint32_t>> unknowns;  // slot and unknown
  for (std::size_t s = 0; s < slots_.slots(); ++s)
    if (const auto u = slots_.unknown(0, s); u && tape_->uses_parameter[s]) unknowns.emplace_back(s, *u);
  const std::size_t passes = (unknowns.size() + 3) / 4;
  std::vector<JetBatch> results;
  for (std::size_t p = 0; p < passes; ++p) {
    std::vector<double> seeds(4 * slots_.slots());
    for (std::size_t k = 4 * p; k < std::min(4 * p + 4, unknowns.size()); ++k) seeds[4 * unknowns[k].first + k % 4] = 1;
    results.emplace_back(x.size, Order::GradientTime);
    run(x, results.back().view(), seeds, false);
  }
  for (std::size_t i = 0; i < x.size; ++i) {
    for (std::size_t k = 0; k < unknowns.size(); ++k) {
      const double value = results[k / 4].view().row(kFx + k % 4)[i];
      if (value == 0 || !std::isfinite(value)) continue;
      rows.index.push_back(unknowns[k].second);
      rows.value.push_back(value);
    }
    rows.end_row();
  }
}

void Expression::do_set_parameters(std::span<const double> values, std::span<const double> rates) {
  slots_.set_parameters(values, rates);
}

void Expression::do_set_time(double t) { slots_.set_time(t); }

Interval Expression::range(const Box& box) const {
  if (box.empty()) return Interval::everything();
  const std::vector<double> q = values();
  return range_of_tape(
      *tape_, {q, {}, time(), true, false},
      {Interval(box.min.x(), box.max.x()), Interval(box.min.y(), box.max.y()), Interval(box.min.z(), box.max.z())});
}

}  // namespace meniscus::field
