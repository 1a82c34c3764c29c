#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>
#include <meniscus/field/field.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

namespace meniscus::field {

void SparseRows::clear() {
  begin.assign(1, 0);
  index.clear();
  value.clear();
}

void SparseRows::end_row() {
  const std::size_t first = begin.back();
  std::vector<std::pair<std::uint32_t, double>> row;
  row.reserve(index.size() - first);
  for (std::size_t k = first; k < index.size(); ++k) row.emplace_back(index[k], value[k]);
  std::stable_sort(row.begin(), row.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  index.resize(first);
  value.resize(first);
  for (const auto& [i, v] : row) {
    if (index.size() > first && index.back() == i) {
      value.back() += v;
    } else {
      index.push_back(i);
      value.push_back(v);
    }
  }
  begin.push_back(index.size());
}

namespace {

bool finite_at(const Positions& x, std::size_t i) {
  return std::isfinite(x.x[i]) && std::isfinite(x.y[i]) && std::isfinite(x.z[i]);
}

}  // namespace

void Field::evaluate(const Positions& x, const JetView& out) const {
  do_evaluate(x, out);
  for (std::size_t i = 0; i < x.size; ++i) {
    if (finite_at(x, i)) continue;
    for (std::size_t r = 0; r < row_count(out.order); ++r) out.row(r)[i] = std::numeric_limits<double>::quiet_NaN();
  }
}

void Field::material_velocity(const Positions& x, const VelocityView& out) const { do_material_velocity(x, out); }

void Field::parameter_rows(const Positions& x, SparseRows& rows) const { do_parameter_rows(x, rows); }

void Field::set_parameters(std::span<const double> values, std::span<const double> rates) {
  if (values.size() != parameters_.size() || (!rates.empty() && rates.size() != values.size()))
    throw InvalidInput("the field has " + std::to_string(parameters_.size()) + " parameters, not " +
                       std::to_string(values.size()));
  const auto finite = [](double v) { return std::isfinite(v); };
  if (!std::all_of(values.begin(), values.end(), finite) || !std::all_of(rates.begin(), rates.end(), finite))
    throw InvalidInput("a parameter is not finite");
  for (std::size_t i = 0; i < values.size(); ++i) parameters_[i].value = values[i];
  do_set_parameters(values, rates);
}

void Field::set_time(double t) {
  if (!std::isfinite(t)) throw InvalidInput("the time is not finite");
  time_ = t;
  do_set_time(t);
}

void Field::do_material_velocity(const Positions& x, const VelocityView& out) const {
  std::fill_n(out.x, x.size, 0.0);
  std::fill_n(out.y, x.size, 0.0);
  std::fill_n(out.z, x.size, 0.0);
}

void Field::do_parameter_rows(const Positions& x, SparseRows& rows) const {
  for (std::size_t i = 0; i < x.size; ++i) rows.end_row();
}

void Field::do_set_parameters(std::span<const double>, std::span<const double>) {}

void Field::do_set_time(double) {}

void evaluate(const Field& field, const Positions& x, const JetView& out, const RunControl& run) {
  parallel_blocks(x.size, kBlock, run, [&](std::size_t begin, std::size_t end) {
    field.evaluate(x.part(begin, end - begin), out.part(begin, end - begin));
  });
}

JetBatch evaluate(const Field& field, const std::vector<Vec3>& points, Order order, const RunControl& run) {
  const PositionBatch x(points);
  JetBatch jets(points.size(), order);
  evaluate(field, x.view(), jets.view(), run);
  return jets;
}

double value_at(const Field& field, const Vec3& point) {
  double value = 0;
  field.evaluate({&point.x(), &point.y(), &point.z(), 1}, {&value, 1, 1, Order::Value});
  return value;
}

}  // namespace meniscus::field
