#pragma once

#include <meniscus/control/factor.h>
#include <meniscus/field/field.h>

#include <cstddef>
#include <span>
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

using SolveOptions = FactorOptions;

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
  std::vector<double> least;           ///< the part of it that the conditions alone ask for: x for Q = 0, held as in x
  std::size_t rank = 0;                ///< independent conditions among the rows
  std::vector<double> residual;        ///< b − A·x, one per condition
  std::vector<std::size_t> conflicts;  ///< conditions that are not met, in rising order
  double condition = 1;                ///< estimate for the worst group of conditions that share unknowns
  std::size_t at_bound = 0;            ///< unknowns held by a bound
  bool best = true;                    ///< false: rounding kept the search for what to hold from ending; x is within bounds
};

/// Minimises |x − Q|²_M among all x within their bounds that meet the conditions as well as possible (least squares), says
/// how that went, and keeps the factors for other targets.
///
/// Conditions that share no unknown are factored apart (Factor). Which unknowns their bounds hold follows from the signs of
/// the Lagrange multipliers: unknowns outside are held, held ones that pull inwards are let go, all at once while that
/// lowers their number, else one by one in a fixed order, which ends [Júdice and Pires 1994, block principal pivoting].
/// Linear in the entries of A apart from the factors. Throws InvalidInput for sizes that do not fit.
class Solver {
 public:
  explicit Solver(System system, const SolveOptions& options = {});

  const Solution& solution() const { return solution_; }
  /// The least change for other targets, one per condition; what a bound holds stays. Bounds are not looked at otherwise.
  std::vector<double> least(std::span<const double> target) const;

 private:
  /// Conditions that share unknowns, directly or through others, and those unknowns.
  struct Group {
    std::vector<std::uint32_t> rows, columns;
    Factor factor;
  };
  enum class Hold : char { Free, Low, High };

  void solve_bounded();
  void solve_free();
  std::vector<double> add_least(std::span<const double> rest, std::vector<double>& x) const;
  std::vector<std::size_t> wrong() const;
  void exchange(std::size_t k);
  void factor();
  double low(std::size_t k) const;
  double high(std::size_t k) const;
  std::vector<double> residual_of(std::span<const double> target, const std::vector<double>& x) const;
  void finish();

  System s_;
  SolveOptions options_;
  std::vector<Group> groups_;
  std::vector<double> scale_;  // 0 for what is frozen or held
  std::vector<Hold> hold_;
  std::vector<double> lambda_;  // multiplier of each condition
  Solution solution_;
};

inline Solution solve(System system, const SolveOptions& options = {}) {
  return Solver(std::move(system), options).solution();
}

}  // namespace meniscus::control
