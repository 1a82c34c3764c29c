#pragma once

#include <meniscus/points/cloud.h>

#include <cstdint>
#include <string>
#include <vector>

namespace meniscus::band {

/// Particles at a moment: what a target is made of.
struct ParticleState {
  std::vector<Vec3> position;
  std::vector<Vec3> velocity;  ///< units per second
  std::vector<double> radius;  ///< > 0
  std::vector<double> weight;  ///< 0 to 1: less while a particle comes or goes
  std::size_t size() const { return position.size(); }
};

/// One frame of a particle sequence, made safe: particles with numbers that are not finite are left out and counted.
struct ParticleFrame {
  ParticleState state;
  std::vector<std::int64_t> id;     ///< empty when the cloud has none
  std::vector<std::size_t> source;  ///< row of the cloud that a particle came from
  std::size_t dropped = 0;
};

/// Reads positions, "v", "id" and "pscale" (else `radius`) of a cloud. Throws InvalidInput for a radius that is not
/// positive.
ParticleFrame particle_frame(const points::Cloud& cloud, double radius);

/// How particles get from one frame to the next.
///
/// Particles of equal id move along the cubic through both positions and velocities [Hermite]; velocities that do not fit
/// the displacements (another unit of time, say) are not used: then the path is straight. Particles without partner fade:
/// those of the first frame go on with their velocity, those of the second come with theirs. Without ids every particle is
/// such a one.
class ParticleMotion {
 public:
  ParticleMotion(const ParticleFrame& from, const ParticleFrame& to, double duration);

  /// The particles at fraction `s` of the way, 0 <= s <= 1. Velocities are mean velocities over the whole way.
  ParticleState at(double s) const;

  std::size_t matched() const { return pairs_; }
  bool uses_velocities() const { return hermite_; }
  /// Root mean square of the matched particles' speed, units per second.
  double typical_speed() const;

 private:
  ParticleState a_, b_;  // matched pairs first, in the order of ids; then those that go (a) or come (b)
  std::size_t pairs_ = 0;
  double duration_;
  bool hermite_ = false;
};

}  // namespace meniscus::band
