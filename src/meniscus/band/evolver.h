#pragma once

#include <meniscus/band/band.h>
#include <meniscus/band/components.h>
#include <meniscus/band/kernels.h>
#include <meniscus/band/strategy.h>
#include <meniscus/base/function_ref.h>

#include <memory>
#include <vector>

namespace meniscus::band {

struct EvolverOptions {
  double tension = 0;              ///< β >= 0, units²/s: a sphere shrinks by dR/dt = -2β/R
  double courant = 0.5;            ///< voxels a surface point may move in a step, in (0, 1)
  int max_steps = 1000;            ///< steps that one advance() may take before it fails
  double redistance_after = 0.75;  ///< voxels of travel after which distances are renewed
};

/// What one advance() did.
struct AdvanceReport {
  int steps = 0;
  int tension_stages = 0;  ///< passes of the tension's inner steps
  int redistancings = 0;
  double max_speed = 0;    ///< largest normal speed asked for by strategies, units per second
  double max_courant = 0;  ///< largest step in voxels
};

/// A surface with a life of its own [DC98]: a band moved by the sum of its strategies and by tension.
///
/// Only nodes next to the surface are carried; the distances of the others follow from theirs after every step, those that
/// no stencil reads now and then and when advance() ends. Transport is explicit (second-order upwind); tension is split off
/// and taken in super-steps (Runge-Kutta-Legendre), whose number grows with the square root of β dt / voxel², so strong
/// tension stays affordable.
class Evolver {
 public:
  Evolver(Band band, EvolverOptions options);

  void add(std::shared_ptr<Strategy> strategy) { strategies_.push_back(std::move(strategy)); }
  /// β from now on; see EvolverOptions::tension.
  void set_tension(double beta) { options_.tension = beta; }
  double tension() const { return options_.tension; }
  void clear_strategies() { strategies_.clear(); }

  /// Moves the surface through `duration` seconds from `time`, in steps of at most `max_step`. On any exception the surface
  /// is as before. Throws Error naming the strategy when a speed is not finite, or when more than max_steps steps were
  /// needed.
  AdvanceReport advance(double time, double duration, double max_step = std::numeric_limits<double>::infinity(),
                        const RunControl& run = {});

  /// Moves every component along its normals until its volume is its goal (to 1e-5), where it has one.
  void settle_volumes(const RunControl& run = {});

  const Band& band() const { return band_; }
  /// Components with volume, area and goal, fresh.
  const std::vector<Component>& components(const RunControl& run = {});
  const Labels& labels() const { return labels_; }
  /// Makes the present volumes the goals, of components without goal or of all.
  void hold_present_volumes(bool all, const RunControl& run = {});
  /// One goal or none per component, in the order of components().
  void set_goals(const std::vector<std::optional<double>>& goals);
  /// Renews distances now and, when told so, volumes, which that shifts: by 0.5 % where a drop's radius is three voxels.
  /// What follows depends on samples and goals alone (a saved skin goes on with the same bits).
  void renew(bool volumes, const RunControl& run = {});

  /// Changes samples from outside: `edit` gets the band and may change samples and wake bricks by Band::unite.
  void edit(FunctionRef<void(Band&)> edit, const RunControl& run = {});

 private:
  std::vector<double> speeds(const Crossings& crossings, double time, double step, const RunControl& run);
  int move(const Crossings& crossings, std::span<const double> speed, double dt, const RunControl& run);
  template <class Work>
  void change_near(double reach, const RunControl& run, const Work& work);
  void transport(const Crossings& crossings, std::span<const double> speed, const StepCoefficients& c,
                 const RunControl& run);
  void relax(int stages, double dt, const RunControl& run);
  void settle_topology(const RunControl& run);
  void follow(bool last, AdvanceReport& report, const RunControl& run);
  std::vector<std::int32_t> labels_of(const Crossings& crossings) const;
  bool tracks_components() const;
  void track(const RunControl& run);

  Band band_;
  EvolverOptions options_;
  std::vector<std::shared_ptr<Strategy>> strategies_;
  Labels labels_;
  std::vector<Component> components_;
  bool tracked_ = false;  // labels and components belong to the present samples
  double travelled_ = 0;  // voxels since the last redistancing
  double way_ = 0;        // voxels since bricks last woke
  Outlines outlines_;     // of the present samples
  Spare next_, before_;   // room for passes over the bricks
  NodeSpeeds speed_;
};

}  // namespace meniscus::band
