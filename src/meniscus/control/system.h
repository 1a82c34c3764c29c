#pragma once

#include <meniscus/field/field.h>

#include <cstddef>
#include <limits>
#include <vector>

namespace meniscus::control {

/// Conditions A·x = b on m unknowns: the change x = q̇ of a field's parameters, or a step of them [WH94 §3, eq. (2.2)].
struct System {
  field::SparseRows rows;      ///< A: one row per condition; indices below scale.size()
  std::vector<double> target;  ///< b
  /// The metric M = diag(1/scale²): how much of each unknown counts as one unit of change. 0 freezes the unknown.
  std::vector<double> scale;
  std::vector<double> desired;       ///< Q, what x should be where the conditions leave it free; empty = 0
  std::vector<double> lower, upper;  ///< bounds on x; empty = none
};

struct SolveOptions {
  double rank_tolerance = 1e-8;   ///< relative size below which a direction counts as not there
  double damping = 0;             ///< μ of Levenberg–Marquardt: minimises |Ax−b|² + μ²|x−Q|²_M instead
  std::size_t dense_limit = 300;  ///< groups of more conditions and unknowns than this are factored as sparse matrices
};

enum class Status {
  Solved,         ///< every condition is met
  LeastSquares,   ///< the conditions contradict each other (or a bound): met as well as possible
  NoParameters,   ///< no condition has an unknown in reach: nothing changes
  InvalidNumber,  ///< a number in the system is not finite: nothing changes
};
const char* name(Status status);

struct Solution {
  Status status = Status::Solved;
  std::vector<double> x;               ///< the change
  std::size_t rank = 0;                ///< independent conditions among the rows
  std::vector<double> residual;        ///< b − A·x, one per condition
  std::vector<std::size_t> conflicts;  ///< conditions that are not met, in rising order
  double condition = 1;                ///< estimate for the worst group of conditions that share unknowns
  std::size_t at_bound = 0;            ///< unknowns held by a bound
};

/// Minimises |x − Q|²_M among all x that meet the conditions as well as possible (least squares), and says how that went.
///
/// Conditions that share no unknown are solved apart. A group is factored by Cholesky if that is safe, by a complete
/// orthogonal decomposition if it is not; groups beyond dense_limit by a sparse, slightly regularised Cholesky factor with
/// refinement. Unknowns that would leave their bounds are held there and the others solved again; what is held is not let
/// go within a call. Linear in the entries of A apart from the factors. Throws InvalidInput for sizes that do not fit.
Solution solve(const System& system, const SolveOptions& options = {});

}  // namespace meniscus::control
