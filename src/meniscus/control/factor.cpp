#include <meniscus/control/factor.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <Eigen/SparseCholesky>

#include <algorithm>
#include <cmath>
#include <optional>

namespace meniscus::control {
namespace {

constexpr double kSafeCholesky = 1e-12;    // reciprocal condition of the squared matrix above which Cholesky serves
constexpr double kRegularisation = 1e-10;  // of a sparse factor, relative to its largest diagonal entry
constexpr double kDense = 0.1;             // share of entries that are there from which dense products are faster
constexpr int kRefinements = 4;

using Matrix = Factor::Matrix;
using Eigen::MatrixXd;
using Eigen::VectorXd;

bool is_wide(const Matrix& a) { return a.rows() <= a.cols(); }

Matrix sparse_gram(const Matrix& a) {
  const Matrix at = a.transpose();
  return is_wide(a) ? Matrix(a * at) : Matrix(at * a);
}

MatrixXd dense_gram(const Matrix& a) {
  if (static_cast<double>(a.nonZeros()) < kDense * static_cast<double>(a.rows()) * static_cast<double>(a.cols()))
    return MatrixXd(sparse_gram(a));
  const MatrixXd d(a);
  return is_wide(a) ? MatrixXd(d * d.transpose()) : MatrixXd(d.transpose() * d);
}

}  // namespace

struct Factor::Decomposition {
  virtual ~Decomposition() = default;
  virtual Answer solve(const VectorXd& r) const = 0;
};

/// The normal equations by dense Cholesky, refined once.
struct Factor::SmallGram final : Decomposition {
  SmallGram(const Matrix& matrix, MatrixXd gram, Eigen::LLT<MatrixXd> llt)
      : a(matrix), g(std::move(gram)), factor(std::move(llt)) {}

  VectorXd refined(const VectorXd& b) const {
    VectorXd z = factor.solve(b);
    z += factor.solve(b - g * z);
    return z;
  }
  Answer solve(const VectorXd& r) const override {
    if (is_wide(a)) {
      const VectorXd lambda = refined(r);
      return {a.transpose() * lambda, lambda};
    }
    const VectorXd y = refined(a.transpose() * r);
    return {y, a * refined(y)};
  }

  Matrix a;
  MatrixXd g;
  Eigen::LLT<MatrixXd> factor;
};

/// A's complete orthogonal decomposition; of the triangle of Aᵀ = Q R where A is much wider than high, which is faster.
struct Factor::Orthogonal final : Decomposition {
  Orthogonal(const Matrix& a, double tolerance) {
    cod.setThreshold(tolerance);
    if (a.cols() <= 2 * a.rows()) {
      cod.compute(MatrixXd(a));
      return;
    }
    qr.emplace(MatrixXd(a.transpose()));
    const MatrixXd r = qr->matrixQR().topRows(a.rows()).triangularView<Eigen::Upper>();
    cod.compute(r.transpose());
  }
  Answer solve(const VectorXd& r) const override {
    VectorXd y = cod.solve(r);
    VectorXd lambda = cod.transpose().solve(y);
    if (qr) {
      y.conservativeResizeLike(VectorXd::Zero(qr->rows()));
      y.applyOnTheLeft(qr->householderQ());
    }
    return {std::move(y), std::move(lambda)};
  }

  std::optional<Eigen::HouseholderQR<MatrixXd>> qr;
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> cod;
};

/// A shifted factor and refinement: directions that exist converge within a few rounds, those that do not stay out of y.
struct Factor::LargeGram final : Decomposition {
  LargeGram(const Matrix& matrix, double damping) : a(matrix), at(a.transpose()), damped(damping > 0) {
    Eigen::SparseMatrix<double> g = sparse_gram(a);
    largest = g.diagonal().maxCoeff();
    shift = kRegularisation * largest + damping * damping;
    Eigen::SparseMatrix<double> identity(g.rows(), g.rows());
    identity.setIdentity();
    g += shift * identity;
    factor.compute(g);
  }
  Answer solve(const VectorXd& r) const override {
    Answer out{VectorXd::Zero(a.cols()), VectorXd::Zero(a.rows())};
    if (factor.info() != Eigen::Success) return out;
    const bool wide = is_wide(a);
    for (int round = 0; round < (damped ? 1 : kRefinements); ++round) {
      const VectorXd rest = r - a * out.y;
      out.y += wide ? VectorXd(at * factor.solve(rest)) : VectorXd(factor.solve(at * rest));
    }
    // From A y, which has no part that A cannot reach: the factor would blow that up by the inverse of its shift.
    out.lambda = wide ? VectorXd(factor.solve(a * out.y)) : VectorXd(a * factor.solve(out.y));
    return out;
  }

  Matrix a, at;
  bool damped;
  double largest = 0, shift = 0;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor;
};

Factor::Factor(Matrix a, const FactorOptions& o) {
  if (static_cast<std::size_t>(std::min(a.rows(), a.cols())) > o.dense_limit) {
    auto large = std::make_unique<LargeGram>(a, o.damping);
    if (large->factor.info() == Eigen::Success) {
      const VectorXd pivots = large->factor.vectorD();
      rank_ = static_cast<std::size_t>((pivots.array() > 100 * kRegularisation * large->largest).count());
      condition_ = std::sqrt(pivots.maxCoeff() / std::max(pivots.minCoeff(), large->shift));
    }
    decomposition_ = std::move(large);
    return;
  }
  MatrixXd g = dense_gram(a);
  g.diagonal().array() += o.damping * o.damping;
  Eigen::LLT<MatrixXd> llt(g);
  const double rcond = llt.info() == Eigen::Success ? llt.rcond() : 0;
  if (rcond > (o.damping > 0 ? 0 : kSafeCholesky)) {
    rank_ = static_cast<std::size_t>(g.rows());
    condition_ = 1 / std::sqrt(rcond);
    decomposition_ = std::make_unique<SmallGram>(a, std::move(g), std::move(llt));
    return;
  }
  auto orthogonal = std::make_unique<Orthogonal>(a, o.rank_tolerance);
  const Eigen::Index rank = orthogonal->cod.rank();
  rank_ = static_cast<std::size_t>(rank);
  const auto& t = orthogonal->cod.matrixQTZ();
  if (rank > 0) condition_ = std::abs(t(0, 0) / t(rank - 1, rank - 1));
  decomposition_ = std::move(orthogonal);
}

Factor::Factor(Factor&&) noexcept = default;
Factor& Factor::operator=(Factor&&) noexcept = default;
Factor::~Factor() = default;

Factor::Answer Factor::solve(const VectorXd& r) const { return decomposition_->solve(r); }

}  // namespace meniscus::control
