#include <meniscus/base/error.h>
#include <meniscus/control/tools.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace meniscus::control {
namespace {

constexpr int kGoalSteps = 30;

/// Calls take(point, share) for points within the radius; share falls smoothly from 1 to 0.
template <class Take>
void each_within(const std::vector<Vec3>& points, const Vec3& center, double radius, const Take& take) {
  if (!center.allFinite() || !std::isfinite(radius) || !(radius > 0))
    throw InvalidInput("a tool needs a finite centre and a radius above zero");
  for (const Vec3& p : points) {
    const double u = (p - center).squaredNorm() / (radius * radius);
    if (u < 1) take(p, (1 - u) * (1 - u));
  }
}

void check(const Vec3& v) {
  if (!v.allFinite()) throw InvalidInput("a tool's motion is not finite");
}

/// κ dA of every element: what the area gains per unit of motion along the normal.
std::vector<double> area_rates(const field::Field& surface, const SurfaceElements& elements) {
  const field::JetBatch jets = field::evaluate(surface, elements.points, field::Order::Hessian);
  std::vector<double> rates;
  for (std::size_t i = 0; i < elements.points.size(); ++i) {
    const double g = jets.gradient(i).norm();
    const Vec3 n = jets.gradient(i) / g;
    const double bend = (jets.hessian(i).trace() - n.dot(jets.hessian(i) * n)) / g;
    rates.push_back(g > 0 ? bend * elements.areas[i] : 0);
  }
  return rates;
}

/// The sum of the rows, each times the element's weight: how the whole changes per unit of each unknown.
std::vector<double> goal_row(const field::SparseRows& rows, const std::vector<double>& weights, std::size_t parameters) {
  std::vector<double> sum(parameters, 0.0);
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (std::size_t e = rows.begin[i]; e < rows.begin[i + 1]; ++e) sum[rows.index[e]] -= rows.value[e] * weights[i];
  return sum;
}

}  // namespace

std::vector<Move> falloff_pull(const std::vector<Vec3>& points, const Vec3& center, double radius, const Vec3& by) {
  check(by);
  std::vector<Move> moves;
  each_within(points, center, radius, [&](const Vec3& p, double share) { moves.push_back({p, p + share * by}); });
  return moves;
}

std::vector<Move> rigid_patch(const std::vector<Vec3>& points, const Vec3& center, double radius, const Vec3& rotation,
                              const Vec3& by) {
  check(by);
  check(rotation);
  const double angle = rotation.norm();
  const Mat3 turn = angle > 0 ? Eigen::AngleAxisd(angle, rotation / angle).toRotationMatrix() : Mat3(Mat3::Identity());
  std::vector<Move> moves;
  each_within(points, center, radius, [&](const Vec3& p, double) {
    moves.push_back({p, center + turn * (p - center) + by});
  });
  return moves;
}

std::vector<Move> inflate(const field::Field& surface, const std::vector<Vec3>& points, const Vec3& center, double radius,
                          double distance) {
  if (!std::isfinite(distance)) throw InvalidInput("a tool's motion is not finite");
  std::vector<Move> moves = keep_fixed(points, center, radius);
  std::vector<Vec3> taken;
  for (const Move& m : moves) taken.push_back(m.point);
  const field::JetBatch jets = field::evaluate(surface, taken, field::Order::Gradient);
  for (std::size_t i = 0; i < moves.size(); ++i) {
    const double u = (taken[i] - center).squaredNorm() / (radius * radius), g = jets.gradient(i).norm();
    if (g > 0) moves[i].target += distance * (1 - u) * (1 - u) / g * jets.gradient(i);
  }
  return moves;
}

std::vector<Move> keep_fixed(const std::vector<Vec3>& points, const Vec3& center, double radius) {
  std::vector<Move> moves;
  each_within(points, center, radius, [&](const Vec3& p, double) { moves.push_back({p, p}); });
  return moves;
}

std::vector<std::size_t> add_moves(ControlSession& session, const std::vector<Move>& moves) {
  std::vector<std::size_t> ids;
  for (const Move& m : moves) {
    ids.push_back(session.add(m.point).id);
    session.aim(ids.back(), m.target);
  }
  return ids;
}

GoalReport reach(field::Field& surface, Measure goal, double target, const MeasureSurface& measure, double tolerance,
                 const std::vector<std::string>& freeze) {
  if (!std::isfinite(target) || !(target > 0)) throw InvalidInput("an area or volume to reach must be above zero");
  GoalReport report;
  std::vector<double> q;
  for (const auto& p : surface.parameters()) q.push_back(p.value);
  SurfaceElements now = measure(surface);
  const auto value = [&](const SurfaceElements& e) {
    return goal == Measure::Volume ? e.volume : std::accumulate(e.areas.begin(), e.areas.end(), 0.0);
  };
  const auto error = [&](const SurfaceElements& e) { return std::abs(value(e) - target) / target; };
  while (!(report.reached = error(now) <= tolerance) && report.steps < kGoalSteps) {
    const SurfaceRows at = surface_rows(surface, now.points, length_scale(surface, now.points));
    System s;
    s.scale = sensitivity_scale(surface, at, freeze);
    const std::vector<double> row =
        goal_row(at.rows, goal == Measure::Volume ? now.areas : area_rates(surface, now), q.size());
    for (std::uint32_t k = 0; k < row.size(); ++k) s.rows.index.push_back(k), s.rows.value.push_back(row[k]);
    s.rows.begin.push_back(row.size());
    // At most a fifth at once: the row holds near the present shape only.
    s.target = {std::clamp(target - value(now), -0.2 * value(now), 0.2 * value(now))};
    StepBounds bounds = step_bounds(surface);
    s.lower = std::move(bounds.lower);
    s.upper = std::move(bounds.upper);
    const Solution x = solve(std::move(s));
    if (x.status == Status::NoParameters || x.status == Status::InvalidNumber) break;
    std::vector<double> next = q;
    for (std::size_t k = 0; k < q.size(); ++k) next[k] += x.x[k];
    surface.set_parameters(next);
    ++report.steps;
    SurfaceElements then = measure(surface);
    if (!(error(then) < error(now))) {
      surface.set_parameters(q);
      break;
    }
    q = std::move(next);
    now = std::move(then);
  }
  report.value = value(now);
  return report;
}

}  // namespace meniscus::control
