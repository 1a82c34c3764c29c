#pragma once

#include <meniscus/motion/strain.h>

#include <memory>
#include <vector>

namespace meniscus::motion {

/// A sparse LDLᵀ factorisation of the energy Σ weight |rows t|² + `guide` Σ k_i |t_i|², k_i a vertex's own stiffness in the
/// first sum, that solves fast and to single precision: a preconditioner. `guide` holds still what strain leaves open. It is
/// kept in 2×2 blocks, a vertex each, which is less than half the memory of a plain factorisation; solving is bound by that.
class StrainFactor {
 public:
  StrainFactor();
  ~StrainFactor();
  StrainFactor(StrainFactor&&) noexcept;
  StrainFactor& operator=(StrainFactor&&) noexcept;

  /// Fills the order of elimination for a mesh: two vertices that some triangle joins stand in one equation.
  void analyse(const std::vector<Triangle>& triangles, std::size_t vertices);
  /// After analyse(), for triangles among those. False if the numbers are not finite. About O(V^1.5).
  bool factorise(const std::vector<Strain>& strains, double guide);
  bool ready() const;
  Strain::Vector solve(const Strain::Vector& right) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace meniscus::motion
