#include <meniscus/base/error.h>
#include <meniscus/control/system.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <Eigen/SparseCholesky>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace meniscus::control {
namespace {

constexpr double kSafeCholesky = 1e-12;      // reciprocal condition of the squared matrix above which Cholesky serves
constexpr double kRegularisation = 1e-10;    // of a sparse factor, relative to its largest diagonal entry
constexpr double kConflictTolerance = 1e-7;  // residual that counts, relative to the group's largest right-hand side
constexpr std::uint32_t kNone = 0xffffffffu;

/// Conditions that share unknowns, directly or through others, and those unknowns.
struct Group {
  std::vector<std::uint32_t> rows, columns;
};

/// What a group's solver answers: y minimises |y| among the least-squares solutions of A y = r.
struct Answer {
  Eigen::VectorXd y;
  std::size_t rank = 0;
  double condition = 1;
};

std::vector<Group> groups_of(const field::SparseRows& rows, const std::vector<double>& scale) {
  std::vector<std::uint32_t> parent(rows.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  std::vector<std::uint32_t> first(scale.size(), kNone);
  for (std::uint32_t i = 0; i < rows.size(); ++i)
    for (std::size_t e = rows.begin[i]; e < rows.begin[i + 1]; ++e) {
      const std::uint32_t k = rows.index[e];
      if (scale[k] == 0 || rows.value[e] == 0) continue;
      if (first[k] == kNone) first[k] = i;
      const std::uint32_t a = root(first[k]), b = root(i);
      parent[std::max(a, b)] = std::min(a, b);
    }
  std::vector<Group> groups;
  std::vector<std::uint32_t> at(rows.size(), kNone);
  for (std::uint32_t i = 0; i < rows.size(); ++i) {
    const std::uint32_t r = root(i);
    if (at[r] == kNone) at[r] = static_cast<std::uint32_t>(groups.size()), groups.emplace_back();
    groups[at[r]].rows.push_back(i);
  }
  for (std::uint32_t k = 0; k < first.size(); ++k)
    if (first[k] != kNone) groups[at[root(first[k])]].columns.push_back(k);
  return groups;
}

/// A of a group with its columns scaled, as triplets.
std::vector<Eigen::Triplet<double>> entries(const System& s, const std::vector<double>& scale, const Group& g,
                                            std::vector<std::uint32_t>& column) {
  for (std::uint32_t c = 0; c < g.columns.size(); ++c) column[g.columns[c]] = c;
  std::vector<Eigen::Triplet<double>> list;
  for (std::uint32_t i = 0; i < g.rows.size(); ++i)
    for (std::size_t e = s.rows.begin[g.rows[i]]; e < s.rows.begin[g.rows[i] + 1]; ++e) {
      const std::uint32_t k = s.rows.index[e];
      if (scale[k] == 0 || s.rows.value[e] == 0) continue;
      list.emplace_back(static_cast<int>(i), static_cast<int>(column[k]), s.rows.value[e] * scale[k]);
    }
  return list;
}

Answer solve_dense(const Eigen::MatrixXd& a, const Eigen::VectorXd& r, const SolveOptions& o) {
  const bool wide = a.rows() <= a.cols();
  Eigen::MatrixXd g = wide ? Eigen::MatrixXd(a * a.transpose()) : Eigen::MatrixXd(a.transpose() * a);
  g.diagonal().array() += o.damping * o.damping;
  const Eigen::LLT<Eigen::MatrixXd> factor(g);
  const double rcond = factor.info() == Eigen::Success ? factor.rcond() : 0;
  Answer answer;
  if (rcond > (o.damping > 0 ? 0 : kSafeCholesky)) {
    Eigen::VectorXd b = wide ? r : Eigen::VectorXd(a.transpose() * r);
    Eigen::VectorXd lambda = factor.solve(b);
    lambda += factor.solve(b - g * lambda);
    answer.y = wide ? Eigen::VectorXd(a.transpose() * lambda) : lambda;
    answer.rank = static_cast<std::size_t>(g.rows());
    answer.condition = 1 / std::sqrt(rcond);
    return answer;
  }
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> cod;
  cod.setThreshold(o.rank_tolerance);
  cod.compute(a);
  answer.y = cod.solve(r);
  answer.rank = static_cast<std::size_t>(cod.rank());
  const Eigen::Index last = cod.rank() - 1;
  if (last >= 0) answer.condition = std::abs(cod.matrixQTZ()(0, 0) / cod.matrixQTZ()(last, last));
  return answer;
}

/// A regularised factor and refinement: directions that exist converge within a few rounds, those that do not stay out of y.
Answer solve_sparse(const Eigen::SparseMatrix<double>& a, const Eigen::VectorXd& r, const SolveOptions& o) {
  const bool wide = a.rows() <= a.cols();
  const Eigen::SparseMatrix<double> at = a.transpose();
  Eigen::SparseMatrix<double> g = wide ? Eigen::SparseMatrix<double>(a * at) : Eigen::SparseMatrix<double>(at * a);
  const double largest = g.diagonal().maxCoeff(), shift = kRegularisation * largest + o.damping * o.damping;
  Eigen::SparseMatrix<double> identity(g.rows(), g.rows());
  identity.setIdentity();
  g += shift * identity;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(g);
  Answer answer;
  answer.y = Eigen::VectorXd::Zero(a.cols());
  if (factor.info() != Eigen::Success) return answer;
  const Eigen::VectorXd pivots = factor.vectorD();
  const double least = 100 * kRegularisation * largest;
  answer.rank = static_cast<std::size_t>((pivots.array() > least).count());
  answer.condition = std::sqrt(pivots.maxCoeff() / std::max(pivots.minCoeff(), shift));
  for (int round = 0; round < (o.damping > 0 ? 1 : 4); ++round) {
    const Eigen::VectorXd rest = r - a * answer.y;
    answer.y += wide ? Eigen::VectorXd(at * factor.solve(rest)) : Eigen::VectorXd(factor.solve(at * rest));
  }
  return answer;
}

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

/// b − A x, row by row.
std::vector<double> residual_of(const System& s, const std::vector<double>& x) {
  std::vector<double> residual = s.target;
  for (std::size_t i = 0; i < residual.size(); ++i)
    for (std::size_t e = s.rows.begin[i]; e < s.rows.begin[i + 1]; ++e) residual[i] -= s.rows.value[e] * x[s.rows.index[e]];
  return residual;
}

/// One solve without bounds: unknowns of scale 0 keep the value they have in `x`.
void solve_free(const System& s, const std::vector<double>& scale, const SolveOptions& o, Solution& out) {
  out.rank = 0;
  out.condition = 1;
  const std::vector<double> rest = residual_of(s, out.x);
  std::vector<std::uint32_t> column(scale.size(), 0);
  for (const Group& g : groups_of(s.rows, scale)) {
    if (g.columns.empty()) continue;
    const auto n = static_cast<Eigen::Index>(g.rows.size()), m = static_cast<Eigen::Index>(g.columns.size());
    Eigen::VectorXd r(n);
    for (Eigen::Index i = 0; i < n; ++i) r[i] = rest[g.rows[static_cast<std::size_t>(i)]];
    const auto list = entries(s, scale, g, column);
    Answer answer;
    if (static_cast<std::size_t>(std::min(n, m)) <= o.dense_limit) {
      Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, m);
      for (const auto& t : list) a(t.row(), t.col()) += t.value();
      answer = solve_dense(a, r, o);
    } else {
      Eigen::SparseMatrix<double> a(n, m);
      a.setFromTriplets(list.begin(), list.end());
      answer = solve_sparse(a, r, o);
    }
    out.rank += answer.rank;
    out.condition = std::max(out.condition, answer.condition);
    for (std::size_t c = 0; c < g.columns.size(); ++c)
      out.x[g.columns[c]] += scale[g.columns[c]] * answer.y[static_cast<Eigen::Index>(c)];
  }
}

/// Holds every unknown that left its bounds there; says whether there was one.
bool hold_at_bounds(const System& s, std::vector<double>& held, std::vector<double>& scale, Solution& out) {
  bool any = false;
  for (std::size_t k = 0; k < scale.size(); ++k) {
    const double low = s.lower.empty() ? -std::numeric_limits<double>::infinity() : s.lower[k];
    const double high = s.upper.empty() ? std::numeric_limits<double>::infinity() : s.upper[k];
    if (scale[k] == 0 || (out.x[k] >= low && out.x[k] <= high)) continue;
    held[k] = std::max(low, std::min(high, out.x[k]));
    scale[k] = 0;
    ++out.at_bound;
    any = true;
  }
  return any;
}

void find_conflicts(Solution& out, const System& s) {
  double size = 0;
  for (const double b : s.target) size = std::max(size, std::abs(b));
  for (std::size_t i = 0; i < s.rows.size(); ++i)
    for (std::size_t e = s.rows.begin[i]; e < s.rows.begin[i + 1]; ++e)
      size = std::max(size, std::abs(s.rows.value[e] * out.x[s.rows.index[e]]));
  for (std::size_t i = 0; i < out.residual.size(); ++i)
    if (std::abs(out.residual[i]) > kConflictTolerance * size) out.conflicts.push_back(i);
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

Solution solve(const System& s, const SolveOptions& options) {
  check(s);
  const std::size_t m = s.scale.size();
  Solution out;
  out.x.assign(m, 0.0);
  out.residual = s.target;
  if (!all_finite(s.rows.value) || !all_finite(s.target) || !all_finite(s.scale) || !all_finite(s.desired)) {
    out.status = Status::InvalidNumber;
    return out;
  }
  std::vector<double> scale = s.scale, held(m, 0.0);
  if (!s.desired.empty())
    for (std::size_t k = 0; k < m; ++k) held[k] = scale[k] == 0 ? 0 : s.desired[k];
  do {
    out.x = held;
    solve_free(s, scale, options, out);
  } while (hold_at_bounds(s, held, scale, out));
  out.residual = residual_of(s, out.x);
  if (!all_finite(out.x)) {
    out.x.assign(m, 0.0);
    out.residual = s.target;
    out.status = Status::InvalidNumber;
    return out;
  }
  find_conflicts(out, s);
  if (!out.conflicts.empty()) out.status = Status::LeastSquares;
  if (out.rank == 0 && out.at_bound == 0 && s.rows.size() > 0) out.status = Status::NoParameters;
  return out;
}

}  // namespace meniscus::control
