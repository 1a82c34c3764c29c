#include <meniscus/base/error.h>
#include <meniscus/base/suggest.h>
#include <meniscus/control/rows.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace meniscus::control {
namespace {

using field::Quantity;

bool names(const std::string& freeze, const std::string& parameter) {
  return parameter.starts_with(freeze) &&
         (parameter.size() == freeze.size() || parameter[freeze.size()] == '.' || parameter[freeze.size()] == '[');
}

void apply_freeze(const std::vector<field::Parameter>& parameters, const std::vector<std::string>& freeze,
                  std::vector<double>& scale) {
  for (const std::string& f : freeze) {
    bool found = false;
    for (std::size_t k = 0; k < parameters.size(); ++k)
      if (names(f, parameters[k].name)) scale[k] = 0, found = true;
    if (found) continue;
    std::vector<std::string_view> all;
    for (const auto& p : parameters) all.push_back(p.name);
    throw InvalidInput("the surface has no parameter '" + f + "' to freeze" + did_you_mean(f, all));
  }
}

}  // namespace

SurfaceRows surface_rows(const field::Field& surface, const std::vector<Vec3>& points, double length) {
  SurfaceRows out;
  const field::PositionBatch x(points);
  const field::JetBatch jets = field::evaluate(surface, points, field::Order::Gradient);
  field::SparseRows raw;
  surface.parameter_rows(x.view(), raw);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double f = jets.value(i), g = jets.gradient(i).norm();
    const double slope = std::max(g, std::abs(f) / length);
    const bool usable = std::isfinite(slope) && slope > 0;
    out.distance.push_back(std::isfinite(f) ? (usable ? f / slope : 0) : f);
    out.normal.push_back(g > 0 && std::isfinite(g) ? Vec3(jets.gradient(i) / g) : Vec3(Vec3::Zero()));
    for (std::size_t e = raw.begin[i]; usable && e < raw.begin[i + 1]; ++e) {
      out.rows.index.push_back(raw.index[e]);
      out.rows.value.push_back(raw.value[e] / slope);
    }
    out.rows.begin.push_back(out.rows.index.size());
  }
  return out;
}

std::vector<double> sensitivity_scale(const field::Field& surface, const SurfaceRows& points,
                                      const std::vector<std::string>& freeze) {
  const auto& parameters = surface.parameters();
  std::vector<double> most(parameters.size(), 0.0);
  std::array<double, 6> shared{};
  for (std::size_t e = 0; e < points.rows.index.size(); ++e) {
    const std::uint32_t k = points.rows.index[e];
    const auto kind = static_cast<std::size_t>(parameters[k].quantity);
    most[k] = std::max(most[k], std::abs(points.rows.value[e]));
    shared[kind] = std::max(shared[kind], most[k]);
  }
  std::vector<double> scale(parameters.size(), 1.0);
  for (std::size_t k = 0; k < scale.size(); ++k) {
    const Quantity kind = parameters[k].quantity;
    if (kind == Quantity::Coordinate || kind == Quantity::Length) continue;
    const double sensitivity = kind == Quantity::Number ? most[k] : shared[static_cast<std::size_t>(kind)];
    scale[k] = sensitivity > 0 ? 1 / sensitivity : 0;
  }
  apply_freeze(parameters, freeze, scale);
  return scale;
}

StepBounds step_bounds(const field::Field& surface) {
  StepBounds bounds;
  for (const field::Parameter& p : surface.parameters()) {
    const bool size = p.quantity == Quantity::Length && p.min == 0 && p.value > 0;
    bounds.lower.push_back(std::min(0.0, size ? -0.999 * p.value : p.min - p.value));
    bounds.upper.push_back(std::max(0.0, p.max - p.value));
  }
  return bounds;
}

std::optional<Vec3> nearest_surface_point(const field::Field& surface, const Vec3& point, double length) {
  Vec3 x = point;
  for (int step = 0; step < 50; ++step) {
    const field::JetBatch jet = field::evaluate(surface, {x}, field::Order::Gradient);
    const double g = jet.gradient(0).norm();
    if (!std::isfinite(jet.value(0)) || !(g > 0)) return {};
    const double d = jet.value(0) / g;
    x -= std::clamp(d, -0.1 * length, 0.1 * length) / g * jet.gradient(0);
    if (std::abs(d) <= 1e-13 * (length + x.norm())) return x;
  }
  return {};
}

double length_scale(const field::Field& surface, const std::vector<Vec3>& points) {
  const Box bounds = surface.bounds();
  if (bounds.finite() && bounds.diameter() > 0) return bounds.diameter();
  Box box;
  for (const Vec3& p : points) box.extend(p);
  return box.finite() && box.diameter() > 0 ? box.diameter() : 1;
}

}  // namespace meniscus::control
