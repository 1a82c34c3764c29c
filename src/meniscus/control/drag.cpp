#include <meniscus/base/error.h>
#include <meniscus/control/drag.h>

#include <algorithm>
#include <cmath>

namespace meniscus::control {
namespace {

constexpr std::size_t kFewParameters = 2000;  // so many are all tried as movers of a control's stuff
constexpr int kHalvings = 6;
constexpr int kMostSteps = 10000;   // of a run
constexpr int kPatience = 600;      // steps in place until the shape is the nearest to the drag's beginning
constexpr double kBack = 0.001;     // of the way back is gone in a step, in lengths, or as much as the hand moves
constexpr double kSlow = 0.2;       // share of a correction that the next may have before the rows are made anew
constexpr double kArrived = 1e-12;  // in lengths
constexpr double kHeld = 1e-8;      // residual that does not count, in lengths

using field::Quantity;

/// Two directions that span the plane across n.
std::pair<Vec3, Vec3> tangents(const Vec3& n) {
  Vec3::Index axis;
  n.cwiseAbs().minCoeff(&axis);
  const Vec3 e = Vec3::Unit(axis);
  const Vec3 u = (e - e.dot(n) * n).normalized();
  const Vec3 v(n.y() * u.z() - n.z() * u.y(), n.z() * u.x() - n.x() * u.z(), n.x() * u.y() - n.y() * u.x());
  return {u, v};
}

/// x with the change y added, kept within [low, high] of the parameter despite rounding.
double moved(const field::Parameter& p, double x, double change) { return std::clamp(x + change, p.min, p.max); }

double largest_change(const std::vector<double>& change, const std::vector<double>& scale) {
  double most = 0;
  for (std::size_t k = 0; k < change.size(); ++k)
    if (scale[k] > 0) most = std::max(most, std::abs(change[k] / scale[k]));
  return most;
}

}  // namespace

/// A try to hold the controls at given positions.
struct ControlSession::Attempt {
  bool held = false;
  bool settled = false;  // q is the nearest to the drag's beginning, too
  std::vector<double> q;
  Solution solution;  // of the last Newton step that was factored
  Descent descent;
  std::vector<double> distance;
  int newton_steps = 0;
};

/// The share is s·y/y·y of the last step s and change of the pull −y [Barzilai and Borwein 1988].
ControlSession::Descent ControlSession::Descent::next(const std::vector<double>& at, const Solution& found,
                                                      const std::vector<double>& scale) const {
  Descent d{at, found.x, share};
  for (std::size_t k = 0; k < at.size(); ++k) d.pull[k] -= found.least[k];
  double sy = 0, yy = 0;
  for (std::size_t k = 0; k < q.size(); ++k) {
    if (scale[k] == 0) continue;
    const double s = (at[k] - q[k]) / scale[k], y = (pull[k] - d.pull[k]) / scale[k];
    sy += s * y;
    yy += y * y;
  }
  if (yy > 0) d.share = sy > 0 ? std::clamp(sy / yy, 0.02, 1.0) : std::max(0.02, 0.5 * share);
  return d;
}

const char* name(StepReport::Outcome outcome) {
  switch (outcome) {
    case StepReport::Outcome::Moving: return "moving";
    case StepReport::Outcome::Arrived: return "arrived";
    case StepReport::Outcome::Unchanged: return "unchanged";
    case StepReport::Outcome::Failed: return "failed";
  }
  return "";
}

ControlSession::ControlSession(field::Field& surface, DragOptions options)
    : surface_(surface), options_(std::move(options)), length_(options_.length.value_or(length_scale(surface, {}))) {
  const auto positive = [](double v) { return std::isfinite(v) && v > 0; };
  if (!positive(length_) || !positive(options_.spring) || !positive(options_.largest_step) ||
      !positive(options_.largest_turn) || !positive(options_.largest_change) || !positive(options_.tolerance) ||
      options_.newton_steps < 1)
    throw InvalidInput("control: lengths, steps and the spring must be above zero");
  rebase();
}

std::vector<double> ControlSession::values() const {
  std::vector<double> q;
  for (const auto& p : surface_.parameters()) q.push_back(p.value);
  return q;
}

Placed ControlSession::add(const Vec3& point, bool sideways) {
  if (!point.allFinite()) throw InvalidInput("a control point is not finite");
  const auto on = nearest_surface_point(surface_, point, length_);
  if (!on || (*on - point).norm() > options_.capture * length_)
    throw InvalidInput("a control point does not lie on the surface" +
                       (on ? ": the surface is " + std::to_string((*on - point).norm()) + " away" : std::string()));
  controls_.push_back({*on, *on, *on, sideways});
  stale_ = true;
  return {controls_.size() - 1, (*on - point).norm()};
}

void ControlSession::aim(std::size_t id, const Vec3& target) {
  if (id >= controls_.size()) throw InvalidInput("there is no control " + std::to_string(id));
  if (!target.allFinite()) throw InvalidInput("the target of a control point is not finite");
  controls_[id].target = target;
}

void ControlSession::remove(std::size_t id) {
  if (id >= controls_.size()) throw InvalidInput("there is no control " + std::to_string(id));
  controls_.erase(controls_.begin() + static_cast<std::ptrdiff_t>(id));
  stale_ = true;
}

void ControlSession::rebase() {
  std::vector<Vec3> points;
  for (Control& c : controls_) {
    c.grabbed = c.position;
    points.push_back(c.position);
  }
  rest_ = values();
  const bool all = !options_.samples.empty();
  const SurfaceRows rows = surface_rows(surface_, all ? options_.samples : points, length_);
  scale_ = all ? surface_scale(surface_, rows, options_.freeze) : sensitivity_scale(surface_, rows, options_.freeze);
  descent_ = {};
  build_sideways_rows();
  stale_ = false;
}

void ControlSession::build_sideways_rows() {
  sideways_.clear();
  sideways_rows_.clear();
  std::vector<Vec3> points;
  std::vector<std::size_t> ids;
  for (std::size_t i = 0; i < controls_.size(); ++i)
    if (controls_[i].sideways) points.push_back(controls_[i].position), ids.push_back(i);
  if (points.empty()) return;
  const SurfaceRows at = surface_rows(surface_, points, length_);
  std::vector<char> tried(scale_.size(), scale_.size() <= kFewParameters ? 1 : 0);
  for (const std::uint32_t k : at.rows.index) tried[k] = 1;

  // The stuff's velocity is linear in the rates: one unknown after the other moves at rate 1.
  const auto posed = surface_.clone();
  const field::PositionBatch x(points);
  std::vector<std::vector<std::pair<std::uint32_t, Vec3>>> moves(points.size());
  std::vector<double> rates(scale_.size(), 0.0);
  field::PositionBatch v(points.size());
  for (std::uint32_t k = 0; k < scale_.size(); ++k) {
    if (!tried[k] || scale_[k] == 0 || surface_.parameters()[k].quantity == Quantity::Weight) continue;
    rates[k] = 1;
    posed->set_parameters(rest_, rates);
    rates[k] = 0;
    posed->material_velocity(x.view(), {v.x.data(), v.y.data(), v.z.data()});
    for (std::size_t i = 0; i < points.size(); ++i)
      if (const Vec3 move = v.view()[i]; move.allFinite() && move.squaredNorm() > 0) moves[i].emplace_back(k, move);
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (moves[i].empty()) continue;
    const auto [u, w] = tangents(at.normal[i]);
    for (const Vec3& direction : {u, w}) {
      for (const auto& [k, move] : moves[i])
        sideways_rows_.index.push_back(k), sideways_rows_.value.push_back(move.dot(direction));
      sideways_rows_.begin.push_back(sideways_rows_.index.size());
      sideways_.push_back({ids[i], direction});
    }
  }
}

/// What a Newton step at pose q wants: F_q·x = −F of every control, and of sideways ones that their stuff be as far from
/// where it was grabbed as the control is.
std::vector<double> ControlSession::targets(const std::vector<Vec3>& positions, const std::vector<double>& q,
                                            const std::vector<double>& distance) const {
  std::vector<double> target;
  for (const double d : distance) target.push_back(-d);
  for (std::size_t j = 0; j < sideways_.size(); ++j) {
    const auto& [control, direction] = sideways_[j];
    double wanted = direction.dot(positions[control] - controls_[control].grabbed);
    for (std::size_t e = sideways_rows_.begin[j]; e < sideways_rows_.begin[j + 1]; ++e)
      wanted -= sideways_rows_.value[e] * (q[sideways_rows_.index[e]] - rest_[sideways_rows_.index[e]]);
    target.push_back(wanted);
  }
  return target;
}

System ControlSession::system(const std::vector<Vec3>& positions, const std::vector<double>& q) const {
  SurfaceRows at = surface_rows(surface_, positions, length_);
  System s;
  s.rows = std::move(at.rows);
  s.target = targets(positions, q, at.distance);
  for (std::size_t j = 0; j < sideways_.size(); ++j) {
    for (std::size_t e = sideways_rows_.begin[j]; e < sideways_rows_.begin[j + 1]; ++e) {
      s.rows.index.push_back(sideways_rows_.index[e]);
      s.rows.value.push_back(sideways_rows_.value[e]);
    }
    s.rows.begin.push_back(s.rows.index.size());
  }
  s.scale = scale_;
  s.desired.resize(q.size());
  for (std::size_t k = 0; k < q.size(); ++k) s.desired[k] = rest_[k] - q[k];
  StepBounds bounds = step_bounds(surface_);
  s.lower = std::move(bounds.lower);
  s.upper = std::move(bounds.upper);
  return s;
}

/// The first round corrects F = 0 and goes a share of the way towards the drag's beginning that the rows leave open: the
/// whole way would overshoot where the surface bends much between there and here. Further rounds correct F = 0 alone, with
/// the first one's factors while these serve.
ControlSession::Attempt ControlSession::project(const std::vector<Vec3>& positions, std::vector<double> q, double part) {
  double hand = 0;
  for (std::size_t i = 0; i < positions.size(); ++i) hand = std::max(hand, (positions[i] - controls_[i].position).norm());
  Attempt a;
  const double most = options_.largest_change * length_, enough = options_.tolerance * length_;
  std::optional<Solver> solver;
  std::vector<double> x;
  double last = 0;
  while (a.newton_steps < options_.newton_steps) {
    const bool first = a.newton_steps++ == 0;
    surface_.set_parameters(q);
    if (!solver) {
      solver.emplace(system(positions, q));
      a.solution = solver->solution();
      if (a.solution.status == Status::InvalidNumber || a.solution.status == Status::NoParameters) break;
      x = a.solution.least;
      if (first) {
        a.descent = descent_.next(q, a.solution, scale_);
        const double back = largest_change(a.descent.pull, scale_), most_back = std::max(hand, part * kBack * length_);
        a.descent.share = std::min(part * a.descent.share, back > 0 ? most_back / back : 1);
        a.settled = std::max(largest_change(x, scale_), largest_change(a.descent.pull, scale_)) <= enough;
        for (std::size_t k = 0; k < q.size(); ++k) x[k] += a.descent.share * a.descent.pull[k];
      }
    } else {
      x = solver->least(targets(positions, q, surface_distance(surface_, positions, length_)));
    }
    const double change = largest_change(x, scale_);
    for (std::size_t k = 0; k < q.size(); ++k)
      q[k] = moved(surface_.parameters()[k], q[k], change > most ? most / change * x[k] : x[k]);
    if (a.settled || change <= enough) break;
    if (!first) {
      // The next round would find about change²/last.
      if (change < last && change * change / last <= 0.01 * kHeld * length_) break;
      if (change > kSlow * last) solver.reset();
    }
    last = change;
  }
  a.q = std::move(q);
  surface_.set_parameters(a.q);
  a.distance = surface_distance(surface_, positions, length_);
  double worst = 0;
  for (const double d : a.distance) worst = std::isfinite(d) ? std::max(worst, std::abs(d)) : HUGE_VAL;
  // Contradicting controls converge slowly, to a compromise: that counts as held if the compromise is near.
  a.held = (a.settled && worst < HUGE_VAL) || worst <= kHeld * length_ ||
           (a.solution.status == Status::LeastSquares && worst <= options_.largest_step * length_);
  return a;
}

/// How far each control may go in a step, world units.
std::vector<double> ControlSession::farthest() const {
  std::vector<Vec3> points;
  for (const Control& c : controls_) points.push_back(c.position);
  const field::JetBatch jets = field::evaluate(surface_, points, field::Order::Hessian);
  std::vector<double> most;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double radius = jets.gradient(i).norm() / jets.hessian(i).norm();
    most.push_back(std::min(options_.largest_step * length_, radius > 0 ? options_.largest_turn * radius : HUGE_VAL));
  }
  return most;
}

StepReport ControlSession::report(const Attempt& a, const std::vector<Vec3>& positions) const {
  StepReport r;
  r.status = a.solution.status;
  r.residual = a.distance;
  r.condition = a.solution.condition;
  r.at_bound = a.solution.at_bound;
  r.newton_steps = a.newton_steps;
  r.parameters = static_cast<std::size_t>(std::count_if(scale_.begin(), scale_.end(), [](double s) { return s > 0; }));
  for (std::size_t i = 0; i < r.residual.size(); ++i)
    if (!(std::abs(r.residual[i]) <= kHeld * length_)) r.conflicts.push_back(i);
  for (const std::size_t c : a.solution.conflicts)
    if (c >= controls_.size() && std::abs(a.solution.residual[c]) > kHeld * length_) {
      const std::size_t id = sideways_[c - controls_.size()].control;
      if (r.slipped.empty() || r.slipped.back() != id) r.slipped.push_back(id);
    }
  if (r.status != Status::NoParameters && r.status != Status::InvalidNumber)
    r.status = r.conflicts.empty() && r.slipped.empty() ? Status::Solved : Status::LeastSquares;
  r.rank = a.solution.rank;
  if (sideways_.empty()) return r;
  // The rank without the rows that only a drag adds.
  System plain;
  plain.rows = surface_rows(surface_, positions, length_).rows;
  plain.target.assign(plain.rows.size(), 0.0);
  plain.scale = scale_;
  r.rank = solve(std::move(plain)).rank;
  return r;
}

StepReport ControlSession::advance(double dt, const Follow* follow) {
  if (!std::isfinite(dt) || !(dt > 0)) throw InvalidInput("a control step must be longer than zero");
  if (stale_) rebase();
  const std::vector<double> before = values();
  const double close = -std::expm1(-options_.spring * dt);
  const std::vector<double> most = farthest();
  Attempt attempt;
  std::vector<Vec3> positions(controls_.size());
  double part = 1;
  for (int halving = 0; halving <= kHalvings && !attempt.held; ++halving, part *= 0.5) {
    for (std::size_t i = 0; i < controls_.size(); ++i) {
      const Vec3 way = controls_[i].target - controls_[i].position;
      const double far = way.norm();
      // Short rests of the way are made at once: a spring alone would never arrive.
      const double go = far <= std::min(1e-3 * length_, most[i]) ? part : part * std::min(close, most[i] / far);
      positions[i] = go == 1 ? controls_[i].target : Vec3(controls_[i].position + go * way);
    }
    attempt = project(positions, before, part);
    if (attempt.solution.status == Status::NoParameters || attempt.solution.status == Status::InvalidNumber) break;
  }
  const bool unchanged = attempt.solution.status == Status::NoParameters;
  const bool kept = attempt.held && !unchanged && attempt.solution.status != Status::InvalidNumber;
  if (!kept)
    for (std::size_t i = 0; i < controls_.size(); ++i) positions[i] = controls_[i].position;
  const std::vector<double>& after = kept ? attempt.q : before;
  if (follow != nullptr) {
    std::vector<double> rates(before.size());
    for (std::size_t k = 0; k < rates.size(); ++k) rates[k] = (after[k] - before[k]) / dt;
    surface_.set_parameters(before, rates);
    (*follow)(surface_, dt);
  }
  if (follow != nullptr || !kept) surface_.set_parameters(after);
  if (!kept) attempt.distance = surface_distance(surface_, positions, length_);
  if (kept) descent_ = std::move(attempt.descent);

  StepReport r = report(attempt, positions);
  for (std::size_t i = 0; i < controls_.size(); ++i) {
    controls_[i].position = positions[i];
    r.away = std::max(r.away, (controls_[i].target - positions[i]).norm());
  }
  using Outcome = StepReport::Outcome;
  const bool there = r.away <= kArrived * length_;
  r.settled = attempt.settled || (there && !kept);  // a step in place that failed: nothing nearer is found
  r.outcome = controls_.empty() ? Outcome::Arrived
              : unchanged       ? Outcome::Unchanged
              : there           ? Outcome::Arrived
              : !kept           ? Outcome::Failed
                                : Outcome::Moving;
  return r;
}

StepReport ControlSession::advance_all(double dt, const Follow* follow) {
  StepReport r;
  for (int i = 0, waited = 0; i < kMostSteps && waited < kPatience; ++i) {
    r = advance(dt, follow);
    if (r.outcome == StepReport::Outcome::Arrived && r.status == Status::Solved && !r.settled)
      ++waited;
    else if (r.outcome != StepReport::Outcome::Moving)
      break;
  }
  return r;
}

}  // namespace meniscus::control
