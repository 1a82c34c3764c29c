#include <meniscus/base/error.h>
#include <meniscus/control/fit.h>
#include <meniscus/control/system.h>

#include <algorithm>
#include <cmath>

namespace meniscus::control {
namespace {

double square_sum(const std::vector<double>& v) {
  double sum = 0;
  for (const double x : v) sum += x * x;
  return sum;
}

}  // namespace

FitReport fit(field::Field& surface, const std::vector<Vec3>& points, const FitOptions& options, RunControl run) {
  Box box;
  for (const Vec3& p : points) {
    if (!p.allFinite()) throw InvalidInput("a point to fit is not finite");
    box.extend(p);
  }
  const double length = options.length.value_or(box.diameter() > 0 ? box.diameter() : length_scale(surface, points));
  if (!std::isfinite(length) || !(length > 0)) throw InvalidInput("the length scale of a fit must be above zero");
  const double count = static_cast<double>(std::max<std::size_t>(points.size(), 1));

  std::vector<double> q;
  for (const auto& p : surface.parameters()) q.push_back(p.value);
  SurfaceRows at = surface_rows(surface, points, length);
  double cost = square_sum(at.distance);
  FitReport report;
  report.rms_before = std::sqrt(cost / count);
  const std::vector<double> scale = sensitivity_scale(surface, at, options.freeze);
  report.parameters = static_cast<std::size_t>(std::count_if(scale.begin(), scale.end(), [](double s) { return s > 0; }));

  double damping = 0.1;  // rows are of order one: so is it
  std::vector<double> past{cost};
  for (; report.steps < options.most_steps && report.parameters > 0; ++report.steps) {
    if (run.cancelled()) throw Cancelled();
    const double rms = std::sqrt(cost / count);
    const bool stalled =
        past.size() > 10 && std::sqrt(past[past.size() - 11]) * (1 - options.least_progress) < std::sqrt(cost);
    if ((report.converged = rms <= options.tolerance * length || stalled || damping > 1e9)) break;
    System s;
    s.rows = at.rows;
    for (const double d : at.distance) s.target.push_back(-d);
    s.scale = scale;
    StepBounds bounds = step_bounds(surface);
    s.lower = std::move(bounds.lower);
    s.upper = std::move(bounds.upper);
    SolveOptions how;
    how.damping = damping;
    const Solution x = solve(s, how);
    std::vector<double> next = q;
    for (std::size_t k = 0; k < q.size(); ++k) next[k] += x.x[k];
    surface.set_parameters(next);
    SurfaceRows then = surface_rows(surface, points, length);
    const double new_cost = square_sum(then.distance);
    if (new_cost < cost) {
      q = std::move(next);
      at = std::move(then);
      cost = new_cost;
      past.push_back(cost);
      damping = std::max(damping / 3, 1e-9);
    } else {
      surface.set_parameters(q);
      damping *= 4;
    }
    run.progress(static_cast<double>(report.steps + 1) / options.most_steps, "fit");
  }
  report.rms = std::sqrt(cost / count);
  report.residual = std::move(at.distance);
  for (const double d : report.residual) report.largest = std::max(report.largest, std::abs(d));
  return report;
}

}  // namespace meniscus::control
