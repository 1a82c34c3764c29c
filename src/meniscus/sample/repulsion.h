#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/sample/neighbour_grid.h>
#include <meniscus/sample/surface_points.h>

#include <span>
#include <vector>

namespace meniscus::sample {

/// Neighbours farther than this many radii of either are not felt: what lies beyond adds under 0.3 % of alpha to a particle
/// at rest, and the rest energy of the hexagonal lattice stays 0.8 alpha at spacing 2.017 σ.
inline constexpr double kRepulsionReach = 3.7;

/// What its neighbours do to a particle. [WH94 §4, THEORY §3]
struct Repulsion {
  Vec3 velocity = Vec3::Zero();  ///< P = Σ [E_ij + (σ_i/σ_j)² E_ji] r_ij, wanted velocity (the printed sign corrected)
  double energy = 0;             ///< D = Σ E_ij
  double energy_slope = 0;       ///< D_σ = (1/σ³) Σ |r_ij|² E_ij: how D answers to its radius
};

/// Repulsion of particle i with radii `sigma`, energies E_ij = alpha exp(−|r_ij|²/(2σ_i²)) weighted by same_sheet().
Repulsion repulsion(const SurfacePoints& points, std::span<const double> sigma, double alpha, std::size_t i,
                    std::span<const std::uint32_t> neighbours);

}  // namespace meniscus::sample
