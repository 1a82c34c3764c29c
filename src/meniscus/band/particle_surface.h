#pragma once

#include <meniscus/band/band.h>
#include <meniscus/band/particle_cells.h>
#include <meniscus/band/particle_motion.h>

#include <array>
#include <span>
#include <vector>

namespace meniscus::band {

/// Memory of a brick of 512 voxels while a skin works on it: samples, their copies in time, speeds and labels.
inline constexpr double kBytesPerBrick = 20e3;

/// How particles make a surface. A lone particle is a sphere of its radius with each.
enum class ParticleKernel {
  Blobs,        ///< F = (3/4)³ - Σ (1 - d²/(2r)²)³: the paper's compact blobs; bulges where particles are dense
  Averaged,     ///< |x - x̄| - r̄ with kernel means x̄, r̄ [Zhu & Bridson 2005]: flat where particles lie flat
  Anisotropic,  ///< blobs stretched along the neighbourhood's principal axes [Yu & Turk 2010]: thin sheets stay thin
};

struct ParticleSurfaceOptions {
  ParticleKernel kernel = ParticleKernel::Averaged;
  double support = 3;      ///< of Averaged, in radii
  int min_neighbours = 0;  ///< particles with fewer others within two radii are strays and make no surface
};

/// The surface that particles ask for, as a distance. Evaluated where the skin is, never on a whole grid.
class ParticleSurface {
 public:
  ParticleSurface(const ParticleState& particles, const ParticleSurfaceOptions& options, const RunControl& run = {});

  /// Signed distance to the surface, first order, limited to ±reach, at every point; compact runs of points (as crossings
  /// are) cost least. World units.
  void distance(const field::Positions& x, double reach, std::span<double> out, const RunControl& run = {}) const;

  /// Signed distance to the union of spheres of `scale` radii about the particles, at most `reach`.
  void sphere_distance(const field::Positions& x, double scale, double reach, std::span<double> out,
                       const RunControl& run = {}) const;

  /// Which points lie within `scale` radii of a particle.
  std::vector<char> covers(const field::Positions& x, double scale, const RunControl& run = {}) const;

  /// The surface itself as a band: what a stateless mesher would make. Throws ResourceLimit, with the memory it would take,
  /// when the bricks that particles reach are more than `max_bricks`.
  Band band(double voxel, std::size_t max_bricks = 1u << 20, const RunControl& run = {}) const;

  /// Positions and radii of the particles that count (no strays), in the order of their cells.
  const std::vector<Vec3>& positions() const { return position_; }
  const std::vector<double>& radii() const { return radius_; }
  const std::vector<double>& weights() const { return weight_; }
  /// They in cells of their largest support.
  const ParticleCells& cells() const { return cells_; }
  std::size_t strays() const { return strays_; }

 private:
  struct Lanes;
  void stretch(const RunControl& run);
  void gather(const Box& box, Lanes& lanes) const;
  void distance_of_group(const field::Positions& x, double reach, Lanes& lanes, double* out) const;

  ParticleSurfaceOptions options_;
  std::vector<Vec3> position_;
  std::vector<double> radius_, weight_, support_;
  std::vector<std::array<float, 6>> metric_;  // Anisotropic alone
  ParticleCells cells_;
  std::size_t strays_ = 0;
};

}  // namespace meniscus::band
