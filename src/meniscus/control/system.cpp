#include <meniscus/base/disjoint_sets.h>
#include <meniscus/base/error.h>
#include <meniscus/control/system.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace meniscus::control {
namespace {

constexpr double kConflictTolerance = 1e-7;  // residual that counts, relative to the group's largest right-hand side
constexpr double kPullTolerance = 1e-9;      // a multiplier that counts, relative to what it is the sum of
constexpr int kPatience = 3;                 // rounds without progress until unknowns change sides one by one
constexpr int kMostRounds = 300;
constexpr std::uint32_t kNone = 0xffffffffu;

bool all_finite(const std::vector<double>& v) {
  return std::all_of(v.begin(), v.end(), [](double x) { return std::isfinite(x); });
}

void check(const System& s) {
  const std::size_t n = s.rows.size(), m = s.scale.size();
  const auto fits = [m](const std::vector<double>& v) { return v.empty() || v.size() == m; };
  if (s.target.size() != n) throw InvalidInput("a control system needs one target per row");
  if (!fits(s.desired) || !fits(s.lower) || !fits(s.upper))
    throw InvalidInput("a control system's vectors must have one entry per unknown");
  for (const std::uint32_t k : s.rows.index)
    if (k >= m) throw InvalidInput("a control system's row names an unknown that does not exist");
}

/// Size of the largest number among the targets and the terms of A x.
double size_of(const System& s, const std::vector<double>& x) {
  double size = 0;
  for (const double b : s.target) size = std::max(size, std::abs(b));
  for (std::size_t e = 0; e < s.rows.index.size(); ++e)
    size = std::max(size, std::abs(s.rows.value[e] * x[s.rows.index[e]]));
  return size;
}

}  // namespace

const char* name(Status status) {
  switch (status) {
    case Status::Solved: return "solved";
    case Status::LeastSquares: return "least_squares";
    case Status::NoParameters: return "no_parameters";
    case Status::InvalidNumber: return "invalid_number";
  }
  return "";
}

Solver::Solver(System system, const SolveOptions& options) : s_(std::move(system)), options_(options) {
  check(s_);
  const std::size_t m = s_.scale.size();
  scale_ = s_.scale;
  hold_.assign(m, Hold::Free);
  solution_.x.assign(m, 0.0);
  solution_.least.assign(m, 0.0);
  solution_.residual = s_.target;
  const bool sound = all_finite(s_.rows.value) && all_finite(s_.target) && all_finite(s_.scale) && all_finite(s_.desired);
  if (sound) solve_bounded();
  if (sound && all_finite(solution_.x) && all_finite(solution_.least)) {
    finish();
    return;
  }
  solution_.x.assign(m, 0.0);
  solution_.least.assign(m, 0.0);
  solution_.residual = s_.target;
  solution_.status = Status::InvalidNumber;
}

double Solver::low(std::size_t k) const { return s_.lower.empty() ? -std::numeric_limits<double>::infinity() : s_.lower[k]; }

double Solver::high(std::size_t k) const { return s_.upper.empty() ? std::numeric_limits<double>::infinity() : s_.upper[k]; }

void Solver::solve_bounded() {
  std::size_t fewest = hold_.size() + 1;
  int patience = kPatience;
  for (int round = 0;; ++round) {
    factor();
    solve_free();
    const std::vector<std::size_t> wrong_ones = wrong();
    if (wrong_ones.empty()) return;
    if (round == kMostRounds) {
      solution_.best = false;
      for (std::size_t k = 0; k < hold_.size(); ++k)
        if (s_.scale[k] > 0) solution_.x[k] = std::clamp(solution_.x[k], low(k), high(k));
      return;
    }
    if (wrong_ones.size() < fewest) {
      fewest = wrong_ones.size();
      patience = kPatience;
    } else {
      --patience;
    }
    if (patience >= 0)
      for (const std::size_t k : wrong_ones) exchange(k);
    else
      exchange(wrong_ones.back());
  }
}

/// Free unknowns outside their bounds, and held ones that would rather go inwards: what conditions ask for comes first, what
/// is desired second.
std::vector<std::size_t> Solver::wrong() const {
  std::vector<std::size_t> list;
  const bool any_held = std::any_of(hold_.begin(), hold_.end(), [](Hold h) { return h != Hold::Free; });
  // Multipliers −dE/dx of the conditions, their rounding, and of the shortest change.
  std::vector<double> missed, missed_size, pulled, pulled_size;
  if (any_held) {
    for (auto* v : {&missed, &missed_size, &pulled, &pulled_size}) v->assign(hold_.size(), 0.0);
    const std::vector<double> residual = residual_of(s_.target, solution_.x);
    const double noise = options_.damping > 0 ? 0 : kConflictTolerance * size_of(s_, solution_.x);
    for (std::size_t i = 0; i < residual.size(); ++i)
      for (std::size_t e = s_.rows.begin[i]; e < s_.rows.begin[i + 1]; ++e) {
        const std::uint32_t k = s_.rows.index[e];
        const double a = s_.rows.value[e] * s_.scale[k], r = std::abs(residual[i]) > noise ? residual[i] : 0;
        missed[k] += a * r, missed_size[k] += std::abs(a * r);
        pulled[k] += a * lambda_[i], pulled_size[k] += std::abs(a * lambda_[i]);
      }
  }
  for (std::size_t k = 0; k < hold_.size(); ++k) {
    if (s_.scale[k] == 0) continue;
    const double x = solution_.x[k];
    if (hold_[k] == Hold::Free) {
      if (x < low(k) || x > high(k)) list.push_back(k);
      continue;
    }
    const double y = (x - (s_.desired.empty() ? 0 : s_.desired[k])) / s_.scale[k];
    const double mu2 = options_.damping * options_.damping;
    double inwards = missed[k] - mu2 * y, size = missed_size[k] + mu2 * std::abs(y);
    if (mu2 == 0 && !(std::abs(inwards) > kPullTolerance * size))
      inwards = pulled[k] - y, size = pulled_size[k] + std::abs(y);
    if (hold_[k] == Hold::High) inwards = -inwards;
    if (inwards > kPullTolerance * size) list.push_back(k);
  }
  return list;
}

void Solver::exchange(std::size_t k) {
  const bool hold = hold_[k] == Hold::Free;
  hold_[k] = !hold ? Hold::Free : solution_.x[k] < low(k) ? Hold::Low : Hold::High;
  scale_[k] = hold ? 0 : s_.scale[k];
}

/// Factors every group of conditions that share unknowns which are free.
void Solver::factor() {
  const field::SparseRows& rows = s_.rows;
  const auto counts = [&](std::size_t e) { return scale_[rows.index[e]] != 0 && rows.value[e] != 0; };
  DisjointSets sets(rows.size());
  std::vector<std::uint32_t> first(scale_.size(), kNone);
  for (std::uint32_t i = 0; i < rows.size(); ++i)
    for (std::size_t e = rows.begin[i]; e < rows.begin[i + 1]; ++e) {
      if (!counts(e)) continue;
      std::uint32_t& f = first[rows.index[e]];
      if (f == kNone)
        f = i;
      else
        sets.join(f, i);
    }
  struct Members {
    std::vector<std::uint32_t> rows, columns;
  };
  std::vector<Members> members;
  std::vector<std::uint32_t> at(rows.size(), kNone);
  for (std::uint32_t i = 0; i < rows.size(); ++i) {
    const std::uint32_t r = sets.root(i);
    if (at[r] == kNone) at[r] = static_cast<std::uint32_t>(members.size()), members.emplace_back();
    members[at[r]].rows.push_back(i);
  }
  std::vector<int> column(scale_.size(), 0);
  for (std::uint32_t k = 0; k < first.size(); ++k) {
    if (first[k] == kNone) continue;
    auto& columns = members[at[sets.root(first[k])]].columns;
    column[k] = static_cast<int>(columns.size());
    columns.push_back(k);
  }
  groups_.clear();
  for (Members& g : members) {
    if (g.columns.empty()) continue;
    std::vector<Eigen::Triplet<double>> list;
    for (std::size_t i = 0; i < g.rows.size(); ++i)
      for (std::size_t e = rows.begin[g.rows[i]]; e < rows.begin[g.rows[i] + 1]; ++e)
        if (counts(e)) list.emplace_back(static_cast<int>(i), column[rows.index[e]], rows.value[e] * scale_[rows.index[e]]);
    Factor::Matrix a(static_cast<Eigen::Index>(g.rows.size()), static_cast<Eigen::Index>(g.columns.size()));
    a.setFromTriplets(list.begin(), list.end());
    Factor factor(std::move(a), options_);
    groups_.push_back({std::move(g.rows), std::move(g.columns), std::move(factor)});
  }
}

/// Adds to x the shortest change of the free unknowns that meets `rest`; returns the conditions' multipliers.
std::vector<double> Solver::add_least(std::span<const double> rest, std::vector<double>& x) const {
  std::vector<double> lambda(rest.size(), 0.0);
  for (const Group& g : groups_) {
    Eigen::VectorXd r(static_cast<Eigen::Index>(g.rows.size()));
    for (std::size_t i = 0; i < g.rows.size(); ++i) r[static_cast<Eigen::Index>(i)] = rest[g.rows[i]];
    const Factor::Answer answer = g.factor.solve(r);
    for (std::size_t c = 0; c < g.columns.size(); ++c)
      x[g.columns[c]] += scale_[g.columns[c]] * answer.y[static_cast<Eigen::Index>(c)];
    for (std::size_t i = 0; i < g.rows.size(); ++i) lambda[g.rows[i]] = answer.lambda[static_cast<Eigen::Index>(i)];
  }
  return lambda;
}

void Solver::solve_free() {
  std::vector<double>&x = solution_.x, &least = solution_.least;
  for (std::size_t k = 0; k < x.size(); ++k) {
    least[k] = hold_[k] == Hold::Free ? 0 : hold_[k] == Hold::Low ? low(k) : high(k);
    x[k] = hold_[k] == Hold::Free && s_.scale[k] > 0 && !s_.desired.empty() ? s_.desired[k] : least[k];
  }
  lambda_ = add_least(residual_of(s_.target, x), x);
  if (s_.desired.empty())
    least = x;
  else
    add_least(residual_of(s_.target, least), least);
}

std::vector<double> Solver::least(std::span<const double> target) const {
  if (target.size() != s_.rows.size()) throw InvalidInput("a control system needs one target per row");
  std::vector<double> x(scale_.size(), 0.0);
  add_least(target, x);
  return x;
}

std::vector<double> Solver::residual_of(std::span<const double> target, const std::vector<double>& x) const {
  std::vector<double> residual(target.begin(), target.end());
  for (std::size_t i = 0; i < residual.size(); ++i)
    for (std::size_t e = s_.rows.begin[i]; e < s_.rows.begin[i + 1]; ++e)
      residual[i] -= s_.rows.value[e] * x[s_.rows.index[e]];
  return residual;
}

void Solver::finish() {
  for (const Group& g : groups_) {
    solution_.rank += g.factor.rank();
    solution_.condition = std::max(solution_.condition, g.factor.condition());
  }
  solution_.at_bound =
      static_cast<std::size_t>(std::count_if(hold_.begin(), hold_.end(), [](Hold h) { return h != Hold::Free; }));
  solution_.residual = residual_of(s_.target, solution_.x);
  const double size = size_of(s_, solution_.x);
  for (std::size_t i = 0; i < solution_.residual.size(); ++i)
    if (std::abs(solution_.residual[i]) > kConflictTolerance * size) solution_.conflicts.push_back(i);
  if (!solution_.conflicts.empty()) solution_.status = Status::LeastSquares;
  if (solution_.rank == 0 && solution_.at_bound == 0 && s_.rows.size() > 0) solution_.status = Status::NoParameters;
}

}  // namespace meniscus::control
