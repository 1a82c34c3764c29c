#pragma once

#include <meniscus/band/evolver.h>
#include <meniscus/band/particle_motion.h>
#include <meniscus/band/particle_surface.h>
#include <meniscus/band/velocity_grid.h>
#include <meniscus/base/attributes.h>
#include <meniscus/points/cloud.h>

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace meniscus::band {

/// Hard bounds, in particle radii; 0: none.
struct SkinShells {
  double inner = 0;  ///< in [0, 1]: the skin covers spheres of this size; single particles begin to show in the surface
  double outer = 4;  ///< > 1: the skin stays within spheres of this size, so that nothing stays where no particle is
};

/// Settings of a skin. Lengths are world units.
struct SkinOptions {
  double radius = 0;               ///< of particles without their own, > 0; 0.6 to 0.8 of their spacing looks right
  std::optional<double> voxel;     ///< edge of a cell; half the radius when not given
  ParticleSurfaceOptions surface;  ///< what the particles ask for
  double follow =
      0.25;  ///< how much of its distance to the target the skin makes up per frame (rate in 1/frame); less: calmer
  /// Tension β in units²/s; when not given, three times follow · radius² per frame, which smooths away what is smaller
  /// than about √3 radii. 0: none.
  std::optional<double> tension;
  /// Every component keeps its volume, through merges and splits. When particles come or go it changes in proportion to
  /// their radii cubed, moving the surface by half a voxel a frame at most.
  bool hold_volume = true;
  std::optional<double>
      carry;  ///< cell over which particle velocities are averaged to carry the skin along; 8 radii when not given
  SkinShells shells;
  bool keep_droplets = true;  ///< a group of particles too small for the tension is shown as it is instead of being eaten
  int max_substeps = 16;      ///< target evaluations per frame; as many as the particles' speed asks for
  std::size_t max_bricks = 1u << 20;  ///< of 512 voxels, kBytesPerBrick each; more is a ResourceLimit
};

/// What one frame took and gave.
struct SkinReport {
  double volume = 0, volume_goal = 0, area = 0;  ///< goal: 0 without holding
  double worst_volume_error = 0;                 ///< largest |V/V₀ - 1| of the components of 100 voxels or more
  std::size_t components = 0, active_nodes = 0, particles = 0, strays = 0, dropped = 0, matched = 0;
  int substeps = 0;              ///< target evaluations
  int steps = 0;                 ///< transport steps
  double max_courant = 0;        ///< voxels
  double flicker = 0;            ///< mean |φ(k-2) - 2φ(k-1) + φ(k)| / voxel near the surface; 0 for the first two frames
  double velocity_residual = 0;  ///< mean distance, voxels, of x + v dt of the frame before from this frame's surface
  std::size_t seeded = 0;        ///< particles that the skin did not reach and that began a piece of their own
  std::size_t lost = 0;  ///< particles of their own, off the body, that no skin is near: eaten, or too small for the grid
};

/// How much a surface trembles over three frames: mean |φa - 2φb + φc| / voxel over nodes within a voxel of the middle one.
double flicker(const Band& a, const Band& b, const Band& c, const RunControl& run = {});

/// An active implicit surface over a particle sequence [DC98]: smooth, steady in time, volume-keeping. The skin of a frame
/// starts from the skin of the frame before.
class Skin {
 public:
  /// Throws InvalidInput for settings without meaning.
  explicit Skin(SkinOptions options);

  /// The first frame: the particles' own surface, brought to rest. May be empty. On any exception the skin is as before.
  SkinReport start(const points::Cloud& particles, double frame_duration, const RunControl& run = {});
  /// The next frame, `frame_duration` seconds later. On any exception the skin is as before.
  SkinReport advance(const points::Cloud& particles, double frame_duration, const RunControl& run = {});
  bool started() const { return evolver_ != nullptr; }

  const Band& band() const { return evolver_->band(); }
  const std::vector<Component>& components() { return evolver_->components(); }
  double voxel() const { return voxel_; }

  /// Velocities of surface points, units per second: normal part from the evolved potential (-f_t/|∇f|, mean of the last
  /// sub-step), tangential part from the particles. [SS11] THEORY §4, §5.
  std::vector<Vec3> velocities(std::span<const Vec3> at, const RunControl& run = {}) const;
  /// Particle attributes carried to surface points by kernel weights: floating-point ones as means, integers of the heaviest
  /// neighbour. Names in `leave_out` are skipped.
  Attributes carried(std::span<const Vec3> at, const std::vector<std::string>& leave_out, const RunControl& run = {}) const;

  /// What must be kept to go on later: the samples are band().grid(), this is the rest.
  struct State {
    std::vector<std::optional<double>> goals;  ///< per component, in their order
    double owed = 1;                           ///< factor by which they are still to change since particles came or went
  };
  State state();
  /// Goes on from a saved band: `particles` are those of the saved frame.
  void resume(Band band, const State& state, const points::Cloud& particles, double frame_duration);

 private:
  std::shared_ptr<ParticleSurface> target(const ParticleState& particles, const RunControl& run) const;
  EvolverOptions evolving(double frame_duration) const;
  void set_strategies(double frame_duration);
  struct Before;
  SkinReport begin(const points::Cloud& particles, double frame_duration, const RunControl& run);
  SkinReport go_on(const points::Cloud& particles, double frame_duration, const Band& was, const RunControl& run);
  void finish(const ParticleSurface& surface, ParticleFrame now, points::Cloud cloud, SkinReport& report,
              const RunControl& run);
  std::vector<Vec3> thrown_ahead(const RunControl& run) const;
  void live(double duration, SkinReport& report, const RunControl& run);
  std::size_t seed(const ParticleSurface& surface, const RunControl& run);
  void bound(const ParticleSurface& surface, const RunControl& run);
  void adopt_births(const ParticleFrame& next, const Band& was, const SkinReport& report, const RunControl& run);

  SkinOptions options_;
  double voxel_;
  double frame_ = 1;
  std::unique_ptr<Evolver> evolver_;
  std::shared_ptr<class ParticlePull> pull_;
  points::Cloud cloud_;
  ParticleFrame now_;
  std::shared_ptr<const VelocityGrid> carry_, local_;
  std::optional<Band> before_;  // at the start of the last sub-step
  double before_step_ = 0;
  double owed_ = 1;                         // as in State
  std::optional<Band> last_, second_last_;  // of the frames before, for the report
  std::vector<Vec3> thrown_;                // x + v dt of the last frame's surface
};

}  // namespace meniscus::band
