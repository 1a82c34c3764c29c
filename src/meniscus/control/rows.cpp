#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>
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

/// What F is divided by to be a distance; 0 where it cannot be one.
double slope_of(double f, double gradient, double length) {
  const double slope = std::max(gradient, std::abs(f) / length);
  return std::isfinite(slope) ? slope : 0;
}

double distance_of(double f, double slope) { return slope > 0 ? f / slope : std::isfinite(f) ? 0 : f; }

}  // namespace

SurfaceRows surface_rows(const field::Field& surface, const std::vector<Vec3>& points, double length) {
  SurfaceRows out;
  const field::PositionBatch x(points);
  const field::JetBatch jets = field::evaluate(surface, points, field::Order::Gradient);
  constexpr std::size_t kPart = 64;
  std::vector<field::SparseRows> parts((points.size() + kPart - 1) / kPart);
  parallel_blocks(points.size(), kPart, {}, [&](std::size_t begin, std::size_t end) {
    surface.parameter_rows(x.view().part(begin, end - begin), parts[begin / kPart]);
  });
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double f = jets.value(i), g = jets.gradient(i).norm(), slope = slope_of(f, g, length);
    out.distance.push_back(distance_of(f, slope));
    out.normal.push_back(g > 0 && std::isfinite(g) ? Vec3(jets.gradient(i) / g) : Vec3(Vec3::Zero()));
    const field::SparseRows& part = parts[i / kPart];
    for (std::size_t e = part.begin[i % kPart]; slope > 0 && e < part.begin[i % kPart + 1]; ++e) {
      out.rows.index.push_back(part.index[e]);
      out.rows.value.push_back(part.value[e] / slope);
    }
    out.rows.begin.push_back(out.rows.index.size());
  }
  return out;
}

std::vector<double> surface_distance(const field::Field& surface, const std::vector<Vec3>& points, double length) {
  const field::JetBatch jets = field::evaluate(surface, points, field::Order::Gradient);
  std::vector<double> distance;
  for (std::size_t i = 0; i < points.size(); ++i)
    distance.push_back(distance_of(jets.value(i), slope_of(jets.value(i), jets.gradient(i).norm(), length)));
  return distance;
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

std::vector<double> surface_scale(const field::Field& surface, const SurfaceRows& samples,
                                  const std::vector<std::string>& freeze) {
  constexpr double kLeast = 0.05;  // of the most effective unknown of a kind
  const auto& parameters = surface.parameters();
  std::vector<double> moved(parameters.size(), 0.0);
  std::array<double, 6> most{};
  for (std::size_t e = 0; e < samples.rows.index.size(); ++e)
    moved[samples.rows.index[e]] += samples.rows.value[e] * samples.rows.value[e];
  for (std::size_t k = 0; k < moved.size(); ++k) {
    moved[k] = std::sqrt(moved[k] / static_cast<double>(std::max<std::size_t>(samples.rows.size(), 1)));
    double& of_kind = most[static_cast<std::size_t>(parameters[k].quantity)];
    of_kind = std::max(of_kind, moved[k]);
  }
  std::vector<double> scale;
  double longest = 0;
  for (std::size_t k = 0; k < moved.size(); ++k) {
    const bool own = parameters[k].quantity == Quantity::Number;
    const double sensitivity =
        own ? moved[k] : std::max(moved[k], kLeast * most[static_cast<std::size_t>(parameters[k].quantity)]);
    scale.push_back(sensitivity > 0 ? 1 / sensitivity : 0);
    const Quantity kind = parameters[k].quantity;
    if (kind == Quantity::Coordinate || kind == Quantity::Length) longest = std::max(longest, scale[k]);
  }
  // Lengths count for at least their size.
  if (longest > 0)
    for (double& s : scale) s /= longest;
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

Box tight_bounds(const field::Field& surface) {
  Box box = surface.bounds();
  if (box.empty() || !box.finite()) return box;
  constexpr int kHalvings = 6;
  for (int a = 0; a < 3; ++a)
    for (const bool upper : {false, true}) {
      const double from = upper ? box.max[a] : box.min[a], size = box.max[a] - box.min[a];
      double& side = upper ? box.max[a] : box.min[a];
      for (double cut = 0.5 * size, off = 0; cut > std::ldexp(size, -kHalvings - 1); cut *= 0.5) {
        Box slab = box;
        const double inner = from + (upper ? -1 : 1) * (off + cut);
        (upper ? slab.min[a] : slab.max[a]) = inner;
        (upper ? slab.max[a] : slab.min[a]) = from;
        if (surface.range(slab).lo > 0) off += cut, side = inner;
      }
    }
  return box;
}

double length_scale(const field::Field& surface, const std::vector<Vec3>& points) {
  const Box bounds = tight_bounds(surface);
  if (bounds.finite() && bounds.diameter() > 0) return bounds.diameter();
  Box box;
  for (const Vec3& p : points) box.extend(p);
  return box.finite() && box.diameter() > 0 ? box.diameter() : 1;
}

}  // namespace meniscus::control
