#pragma once

#include <Eigen/SparseCore>

#include <cstddef>
#include <memory>

namespace meniscus::control {

struct FactorOptions {
  double rank_tolerance = 1e-8;   ///< relative size below which a direction counts as not there
  double damping = 0;             ///< μ: minimises |A y − r|² + μ²|y|² instead
  std::size_t dense_limit = 300;  ///< matrices with more rows and more columns are factored as sparse ones
};

/// Factors of a matrix A of any shape and rank that give, for right-hand side after right-hand side, the shortest of the
/// least-squares solutions of A y = r.
///
/// A Aᵀ (or Aᵀ A, whichever is smaller) by dense Cholesky if its reciprocal condition is above 1e-12, else A by a complete
/// orthogonal decomposition. Beyond dense_limit by a sparse Cholesky factor shifted by 1e-10 of the largest diagonal entry,
/// with refinement; its rank is an estimate.
class Factor {
 public:
  using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  Factor(Matrix a, const FactorOptions& options);
  Factor(Factor&&) noexcept;
  Factor& operator=(Factor&&) noexcept;
  ~Factor();

  struct Answer {
    Eigen::VectorXd y;       ///< the solution
    Eigen::VectorXd lambda;  ///< the shortest with y = Aᵀ lambda: the rows' Lagrange multipliers
  };
  Answer solve(const Eigen::VectorXd& r) const;

  std::size_t rank() const { return rank_; }
  /// Estimate of A's condition among the directions that exist, >= 1.
  double condition() const { return condition_; }

 private:
  struct Decomposition;
  struct SmallGram;
  struct LargeGram;
  struct Orthogonal;
  std::unique_ptr<Decomposition> decomposition_;
  std::size_t rank_ = 0;
  double condition_ = 1;
};

}  // namespace meniscus::control
