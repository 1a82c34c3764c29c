#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/run_control.h>
#include <meniscus/field/field.h>
#include <meniscus/points/cloud.h>
#include <meniscus/sample/density.h>
#include <meniscus/sample/evenness.h>
#include <meniscus/sample/lasting_neighbours.h>
#include <meniscus/sample/surface_points.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace meniscus::sample {

struct Repulsion;

/// The constants of [WH94 §4-5]; defaults are the paper's. Lengths are world units.
struct FloaterOptions {
  enum class Method {
    Adaptive,  ///< each particle has its own radius
    Global,    ///< one radius for all, divided by √2 whenever all rest, every particle splitting: for comparison
  };
  double radius = 0;  ///< wanted repulsion radius σ̂ > 0, at most a quarter of the surface; spacing settles near 2σ̂
  Method method = Method::Adaptive;
  double time_step = 0.03;      ///< seconds of the particles' own dynamics in a step; feedback · time_step and
                                ///< energy_feedback · time_step must stay below 2
  double feedback = 15;         ///< φ, 1/s: how fast drift off the surface decays
  double energy_feedback = 15;  ///< ρ, 1/s: how fast a particle's energy goes to the wanted one
  double alpha = 6;             ///< α: energy of two particles at one place
  double wanted_energy = 0.8;   ///< Ê / α: 0.8 is hexagonal packing at spacing 2.017 σ
  double beta = 10;             ///< β in units of 1/σ̂: keeps lone particles from growing at once
  double rest_speed = 4;        ///< γ, 1/s: a particle is near equilibrium below the speed γσ
  double split_energy = 0.2;    ///< ν: splits only above this share of the wanted energy
  double death_radius = 0.7;    ///< δ: particles below δσ̂ may die
  std::optional<double> largest_radius = {};  ///< σ_max; max(half the surface's diameter, 1.5 σ̂) if not given
  double radius_step = 0.1;  ///< largest relative change of a radius in a step: plain Euler makes radii negative
  /// Share of its last displacement that a particle near equilibrium carries on, in [0, 1): evens out several times faster.
  /// 0 is the paper.
  double momentum = 0.8;
  int search_interval = 16;           ///< steps between two searches for components without particles; 0 = only at the start
  double search_cells = 32;           ///< cells of that search along the longest side of the box
  std::size_t max_count = 5'000'000;  ///< checked before every single birth
  Density density = {};               ///< σ̂ follows it
};

/// What happened in a step.
struct FloaterStep {
  std::vector<std::int64_t> born, died;  ///< ids; `died` holds those that made room
  std::vector<std::int64_t> lost;        ///< ids of particles whose surface vanished
  std::size_t seeded = 0;                ///< of `born`: placed on parts of the surface that had none
  std::size_t singular = 0;              ///< particles left alone because ∇F vanishes there
  std::size_t moving = 0;                ///< particles faster than γσ
  double mean_speed = 0;                 ///< tangential, in σ per second
  bool capped = false;                   ///< a birth was refused at max_count
};

/// Particles that sample a surface and keep sampling it while it moves [WH94]: held to F = 0 by the constraint with
/// feedback, spread by repulsion with a radius of their own, splitting where it is sparse and dying where it is crowded.
///
/// Pose the field at time t, call step(field, dt), pose it at t + dt, and so on; the field's own rates carry the particles
/// along. Ids persist; births and deaths are reported. Deterministic for any thread count (random numbers from the control's
/// seed, the id and the step). About 190 bytes a particle at rest, its neighbours included.
class Floaters {
 public:
  /// Throws InvalidInput for a radius that is not positive, constants that make the steps unstable, or a box that is empty
  /// or not finite.
  Floaters(const Box& box, const FloaterOptions& options, RunControl run = {});

  /// One step while the surface moves on by `dt` seconds (0 = it stands still). The particles' own dynamics advance by
  /// options.time_step in any case. The first step places the seeds: one on each component found.
  FloaterStep step(const field::Field& surface, double dt = 0);

  /// The box from now on, for a surface that leaves the old one. Throws InvalidInput if it is empty or not finite.
  void set_box(const Box& box);

  /// Steps until nothing is born or dies for 20 steps and all are near equilibrium, or `max_steps`. Returns steps made.
  int settle(const field::Field& surface, int max_steps);

  /// Whether the last 20 steps were quiet.
  bool settled() const { return quiet_steps_ >= 20; }
  bool capped() const { return capped_; }

  std::size_t size() const { return points_.size(); }
  const SurfacePoints& points() const { return points_; }
  const std::vector<double>& radii() const { return sigma_; }
  const std::vector<double>& energies() const { return energy_; }
  const std::vector<std::int64_t>& ids() const { return id_; }

  /// The particles on the surface to 1e-9 of the box diameter, by id, with the attributes of a sampling; those that cannot
  /// be put there are left out and counted in `dropped`.
  points::Cloud cloud(const field::Field& surface, std::size_t* dropped = nullptr) const;
  Evenness measured(const field::Field& surface) const;

  /// Memory held, neighbour lists included.
  std::size_t bytes() const;

  /// Adds a particle; its radius is the largest one unless given. For tests and for starts of one's own.
  void add(const Vec3& position, const Vec3& normal, std::optional<double> radius = {});

 private:
  struct Motion;
  void search(const field::Field& surface, FloaterStep& report);
  bool recover(const field::Field& surface, const field::JetBatch& jets, FloaterStep& report);
  Vec3 drift(std::size_t i, const Vec3& normal, const Vec3& along);
  double next_radius(std::size_t i, const Repulsion& r) const;
  void move(const field::Field& surface, double dt, FloaterStep& report);
  void divide_global(const field::Field& surface, FloaterStep& report);
  void populate(const field::Field& surface, FloaterStep& report);
  void split(const field::Field& surface, const std::vector<std::uint32_t>& parents, FloaterStep& report);
  void append(const Vec3& position, const Vec3& normal, double radius);
  void put(std::size_t i, const Vec3& position, const Vec3& normal);
  void remove(std::span<const std::uint32_t> rising);
  void sort();
  void update_neighbours();
  std::vector<double> spacing() const;
  double wanted_radius(std::size_t i) const { return wanted_.empty() ? options_.radius : wanted_[i]; }
  double largest_radius() const;

  Box box_;
  FloaterOptions options_;
  RunControl run_;
  SurfacePoints points_;
  std::vector<double> sigma_, energy_, speed_;  // speed in σ per second
  std::vector<float> drift_;                    // displacements of the last step along the surface, three a particle, in σ
  std::vector<double> wanted_;                  // σ̂ of each particle; empty while density is uniform
  std::vector<std::int64_t> id_;
  std::int64_t next_id_ = 0;
  std::uint64_t step_ = 0;
  int quiet_steps_ = 0;
  std::size_t moving_ = 0;
  bool capped_ = false;
  double global_radius_ = 0;
  double surface_size_ = 0;
  std::size_t unsorted_ = 0;  // births and deaths since the particles were last put in spatial order
  LastingNeighbours neighbours_;
};

}  // namespace meniscus::sample
