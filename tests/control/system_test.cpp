#include <meniscus/base/error.h>
#include <meniscus/base/random.h>
#include <meniscus/control/system.h>

#include <Eigen/QR>
#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::control {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

double uniform(std::uint64_t id, std::uint64_t step) { return 2 * random_uniform(7, id, step)[0] - 1; }

MatrixXd random_matrix(std::uint64_t id, Eigen::Index rows, Eigen::Index columns) {
  MatrixXd a(rows, columns);
  std::uint64_t step = 0;
  for (Eigen::Index i = 0; i < rows; ++i)
    for (Eigen::Index k = 0; k < columns; ++k) a(i, k) = uniform(id, ++step);
  return a;
}

System system_of(const MatrixXd& a, const VectorXd& b) {
  System s;
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    for (Eigen::Index k = 0; k < a.cols(); ++k)
      if (a(i, k) != 0) s.rows.index.push_back(static_cast<std::uint32_t>(k)), s.rows.value.push_back(a(i, k));
    s.rows.begin.push_back(s.rows.index.size());
    s.target.push_back(b[i]);
  }
  s.scale.assign(static_cast<std::size_t>(a.cols()), 1.0);
  return s;
}

VectorXd vector_of(const std::vector<double>& v) {
  return Eigen::Map<const VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
}

TEST(System, TenThousandOfEveryRankAreSolvedOrSaidToBeContradictory) {
  for (std::uint64_t id = 0; id < 10000; ++id) {
    const auto draw = random_uniform(1, id, 0);
    const auto n = static_cast<Eigen::Index>(1 + draw[0] * 8), m = static_cast<Eigen::Index>(1 + draw[1] * 8);
    const auto rank = static_cast<Eigen::Index>(draw[2] * static_cast<double>(std::min(n, m) + 1));
    // Orthogonal factors and singular values within [1, 2]: the rank is beyond doubt.
    const MatrixXd u = Eigen::HouseholderQR<MatrixXd>(random_matrix(3 * id, n, n)).householderQ();
    const MatrixXd v = Eigen::HouseholderQR<MatrixXd>(random_matrix(3 * id + 1, m, m)).householderQ();
    MatrixXd d = MatrixXd::Zero(n, m), pseudo = MatrixXd::Zero(m, n);
    for (Eigen::Index i = 0; i < rank; ++i)
      d(i, i) = 1.5 + 0.5 * uniform(id, 90 + static_cast<std::uint64_t>(i)), pseudo(i, i) = 1 / d(i, i);
    const MatrixXd a = u * d * v.transpose();
    const bool consistent = draw[3] < 0.5;
    const VectorXd b =
        consistent ? VectorXd(a * random_matrix(3 * id + 2, m, 1)) : VectorXd(random_matrix(3 * id + 2, n, 1));
    const VectorXd expected = v * pseudo * u.transpose() * b;

    const Solution x = solve(system_of(a, b));
    ASSERT_EQ(x.rank, static_cast<std::size_t>(rank)) << id;
    ASSERT_LE((vector_of(x.x) - expected).norm(), 1e-11) << id;
    ASSERT_LE((vector_of(x.residual) - (b - a * expected)).norm(), 1e-11) << id;
    if (rank > 0) ASSERT_EQ(x.status == Status::Solved, (b - a * expected).cwiseAbs().maxCoeff() < 1e-9) << id;
    if (rank > 0) ASSERT_LE(x.condition, 1e3) << id;
  }
}

TEST(System, NearlySingularSystemsStayBounded) {
  for (const double epsilon : {1e-3, 1e-6, 1e-9, 1e-12, 1e-15}) {
    MatrixXd a(2, 2);
    a << 1, 1, 1, 1 + epsilon;
    const Solution x = solve(system_of(a, Eigen::Vector2d(1, 1)));
    EXPECT_LE((vector_of(x.x) - Eigen::Vector2d(0.5, 0.5)).norm(), 0.8) << epsilon;
    EXPECT_LE(vector_of(x.residual).norm(), 1e-8) << epsilon;
    if (epsilon <= 1e-9) EXPECT_EQ(x.rank, 1u) << epsilon;
  }
}

TEST(System, DesiredValuesHoldWhereTheConditionsLeaveFreedom) {
  System s = system_of(MatrixXd::Ones(1, 3), VectorXd::Constant(1, 6.0));
  s.desired = {3, 0, 0};
  const Solution x = solve(s);  // the rest of 3 spread evenly
  EXPECT_NEAR(x.x[0], 4, 1e-14);
  EXPECT_NEAR(x.x[1], 1, 1e-14);
  EXPECT_NEAR(x.x[2], 1, 1e-14);
}

TEST(System, ResultsDoNotDependOnUnits) {
  const MatrixXd a = random_matrix(5, 3, 6);
  const VectorXd b = random_matrix(6, 3, 1);
  const Solution x = solve(system_of(a, b));
  MatrixXd in_millimetres = a;
  in_millimetres.col(2) /= 1000;
  System s = system_of(in_millimetres, b);
  s.scale[2] = 1000;
  const Solution y = solve(s);
  EXPECT_NEAR(y.x[2], 1000 * x.x[2], 1e-10);
  for (const std::size_t k : {0u, 1u, 3u, 4u, 5u}) EXPECT_NEAR(y.x[k], x.x[k], 1e-13);
}

TEST(System, FrozenUnknownsStayAndBoundsHold) {
  System s = system_of(MatrixXd::Ones(1, 3), VectorXd::Constant(1, 6.0));
  s.scale[0] = 0;
  s.lower.assign(3, -1.0);
  s.upper = {10, 1, 10};
  const Solution x = solve(s);
  EXPECT_EQ(x.x[0], 0);
  EXPECT_EQ(x.x[1], 1);
  EXPECT_NEAR(x.x[2], 5, 1e-14);
  EXPECT_EQ(x.at_bound, 1u);
  EXPECT_EQ(x.status, Status::Solved);
  s.upper[2] = 2;
  const Solution short_of = solve(s);
  EXPECT_EQ(short_of.status, Status::LeastSquares);
  EXPECT_NEAR(short_of.residual[0], 3, 1e-14);
  EXPECT_EQ(short_of.conflicts, std::vector<std::size_t>{0});
}

/// What a system's answer must satisfy: x within bounds, and at every unknown the derivative of the missed conditions, or if
/// that is zero of the wish to stay, is zero or points out of the bounds.
void expect_best(const System& s, const Solution& found, double rounding) {
  const auto m = static_cast<Eigen::Index>(s.scale.size());
  MatrixXd a = MatrixXd::Zero(static_cast<Eigen::Index>(s.rows.size()), m);
  for (std::size_t i = 0; i < s.rows.size(); ++i)
    for (std::size_t e = s.rows.begin[i]; e < s.rows.begin[i + 1]; ++e)
      a(static_cast<Eigen::Index>(i), s.rows.index[e]) += s.rows.value[e];
  const VectorXd x = vector_of(found.x), wish = x - vector_of(s.desired);
  const VectorXd missed = a.transpose() * (a * x - vector_of(s.target));
  std::vector<Eigen::Index> held;
  MatrixXd free = a;
  for (Eigen::Index k = 0; k < m; ++k) {
    const auto u = static_cast<std::size_t>(k);
    EXPECT_GE(x[k], s.lower[u]);
    EXPECT_LE(x[k], s.upper[u]);
    if (x[k] > s.lower[u] && x[k] < s.upper[u]) {
      EXPECT_NEAR(missed[k], 0, rounding) << k;
      continue;
    }
    EXPECT_GE(x[k] == s.lower[u] ? missed[k] : -missed[k], -rounding) << k;
    held.push_back(k);
    free.col(k).setZero();
  }
  // The wish among free unknowns is met as far as the conditions allow: wish = Aᵀλ there.
  VectorXd free_wish = wish;
  for (const Eigen::Index k : held) free_wish[k] = 0;
  const MatrixXd pseudo = free.transpose().completeOrthogonalDecomposition().pseudoInverse();
  const VectorXd lambda = pseudo * free_wish;
  EXPECT_LE((free.transpose() * lambda - free_wish).norm(), rounding);
  for (const Eigen::Index k : held) {
    if (std::abs(missed[k]) > rounding) continue;
    const double back = wish[k] - a.col(k).dot(lambda);
    EXPECT_GE(x[k] == s.lower[static_cast<std::size_t>(k)] ? back : -back, -rounding) << k;
  }
}

TEST(System, BoundsAreHeldAndLetGoUntilTheAnswerIsTheBest) {
  std::size_t bound = 0, missed = 0;
  for (std::uint64_t id = 0; id < 2000; ++id) {
    const auto draw = random_uniform(11, id, 0);
    const auto n = static_cast<Eigen::Index>(1 + draw[0] * 6), m = static_cast<Eigen::Index>(1 + draw[1] * 10);
    System s = system_of(random_matrix(5 * id, n, m), 2 * random_matrix(5 * id + 1, n, 1));
    for (Eigen::Index k = 0; k < m; ++k) {
      const auto u = random_uniform(12, id, static_cast<std::uint64_t>(k));
      s.lower.push_back(-u[0]);
      s.upper.push_back(u[1]);
      s.desired.push_back(3 * u[2] - 1.5);
    }
    const Solution x = solve(s);
    ASSERT_TRUE(x.best) << id;
    expect_best(s, x, 1e-6);
    ASSERT_FALSE(HasFailure()) << id;
    bound += x.at_bound > 0 ? 1 : 0;
    missed += x.status == Status::LeastSquares ? 1 : 0;
  }
  EXPECT_GT(bound, 1000u);
  EXPECT_GT(missed, 300u);
}

TEST(System, BoundsThatPushOneAnotherAreKeptTogether) {
  // Without bounds the answer is (-1, 3): the first unknown leaves its range; held at 0 the second exceeds its own.
  MatrixXd a(2, 2);
  a << 1, 1, 1, -0.5;
  System s = system_of(a, Eigen::Vector2d(2, -2.5));
  s.desired = {0, 0};
  s.lower = {0, -10};
  s.upper = {10, 1.5};
  const Solution x = solve(s);
  expect_best(s, x, 1e-12);
  s.lower = {-10, -10};
  s.upper = {10, 10};
  EXPECT_NEAR(solve(s).x[0], -1, 1e-12);
}

TEST(System, FactorsServeOtherTargets) {
  const MatrixXd a = random_matrix(21, 4, 9);
  const Solver solver(system_of(a, random_matrix(22, 4, 1)));
  const VectorXd b = random_matrix(23, 4, 1);
  const std::vector<double> target(b.begin(), b.end());
  const Solution fresh = solve(system_of(a, b));
  const std::vector<double> x = solver.least(target);
  for (std::size_t k = 0; k < x.size(); ++k) EXPECT_NEAR(x[k], fresh.x[k], 1e-14);
  EXPECT_THROW(solver.least(std::vector<double>(3)), InvalidInput);
}

TEST(System, NothingInReachAndBadNumbersChangeNothing) {
  System s = system_of(MatrixXd::Zero(2, 3), Eigen::Vector2d(1, 0));
  const Solution x = solve(s);
  EXPECT_EQ(x.status, Status::NoParameters);
  EXPECT_EQ(x.x, std::vector<double>(3, 0.0));
  EXPECT_EQ(x.residual, (std::vector<double>{1, 0}));
  EXPECT_EQ(x.conflicts, std::vector<std::size_t>{0});
  s.target[0] = std::nan("");
  EXPECT_EQ(solve(s).status, Status::InvalidNumber);
  EXPECT_EQ(solve(s).x, std::vector<double>(3, 0.0));
  s.target.pop_back();
  EXPECT_THROW(solve(s), InvalidInput);
  EXPECT_EQ(solve(System{}).status, Status::Solved);
}

/// A chain of conditions on neighbouring unknowns, long enough for the sparse factor.
System chain(std::size_t n, bool contradictory) {
  System s;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = i; k < i + 3; ++k)
      s.rows.index.push_back(static_cast<std::uint32_t>(k)), s.rows.value.push_back(uniform(i, k));
    s.rows.begin.push_back(s.rows.index.size());
    s.target.push_back(uniform(i, 0));
  }
  for (const double shift : {0.0, contradictory ? 1.0 : 0.0}) {  // the first condition twice more
    for (std::size_t e = 0; e < 3; ++e) s.rows.index.push_back(s.rows.index[e]), s.rows.value.push_back(s.rows.value[e]);
    s.rows.begin.push_back(s.rows.index.size());
    s.target.push_back(s.target[0] + shift);
  }
  s.scale.assign(n + 2, 1.0);
  return s;
}

TEST(System, SparseAndDenseFactorsAgreeRedundantConditionsIncluded) {
  for (const bool contradictory : {false, true}) {
    const System s = chain(400, contradictory);
    SolveOptions dense, sparse;
    dense.dense_limit = 1000000;
    sparse.dense_limit = 0;
    const Solution x = solve(s, dense), y = solve(s, sparse);
    EXPECT_EQ(x.rank, 400u);
    EXPECT_EQ(y.rank, 400u);
    EXPECT_EQ(x.status, contradictory ? Status::LeastSquares : Status::Solved);
    EXPECT_EQ(y.status, x.status);
    for (std::size_t k = 0; k < x.x.size(); ++k) ASSERT_NEAR(x.x[k], y.x[k], 1e-6) << k;
  }
}

}  // namespace
}  // namespace meniscus::control
