#pragma once

#include <meniscus/band/components.h>
#include <meniscus/band/crossings.h>

#include <limits>
#include <memory>
#include <span>
#include <string>

namespace meniscus::band {

/// The surface as strategies see it: crossings, components, time.
struct SurfaceSamples {
  const Crossings& crossings;
  std::span<const std::int32_t> component;  ///< of each crossing
  std::span<const Component> components;
  double voxel;
  double time;  ///< seconds
  double step;  ///< the step planned, seconds; the one taken may be shorter
};

/// A reason for the surface to move: the terms of [DC98] (THEORY 5.2), which add up. User-defined ones derive from this.
class Strategy {
 public:
  virtual ~Strategy() = default;
  virtual std::string name() const = 0;
  /// Adds a normal speed (outwards positive, units per second) at every crossing to `speed`, which holds what earlier
  /// strategies asked for. A speed that is not finite makes the step fail.
  virtual void add_speed(const SurfaceSamples& at, std::span<double> speed, const RunControl& run) = 0;
  /// The longest step, seconds, that this strategy tolerates.
  virtual double max_step() const { return std::numeric_limits<double>::infinity(); }
  /// Whether the strategy needs volumes and areas of components.
  virtual bool needs_components() const { return false; }
  /// Whether the strategy needs the normals of crossings: they are left out (empty) when none does.
  virtual bool needs_normals() const { return true; }
};

/// V = -rate · (distance to the target's surface, first order: F/|∇F|), limited to a few voxels' worth: the skin inflates
/// inside its target, deflates outside and rests on its surface.
class Target final : public Strategy {
 public:
  /// `rate` > 0, 1/s: the distance decays as exp(-rate t). `field` must outlive the strategy. `reach`: the distance, world
  /// units, from which on the speed does not grow.
  Target(const field::Field& field, double rate, double reach);
  std::string name() const override { return "target"; }
  void add_speed(const SurfaceSamples& at, std::span<double> speed, const RunControl& run) override;
  double max_step() const override { return 0.5 / rate_; }
  bool needs_normals() const override { return false; }

 private:
  const field::Field& field_;
  double rate_, reach_;
};

/// V = speed · (A₀ - A)/A₀ with A the area of all components together, as in [DC98]: the whole surface moves outwards while
/// it is too small. `goal` A₀ > 0, world units squared; `speed`, units per second, at a relative error of one. What one
/// component loses another may gain: volumes are what is held per component.
class HoldArea final : public Strategy {
 public:
  HoldArea(double goal, double speed);
  std::string name() const override { return "area"; }
  void add_speed(const SurfaceSamples& at, std::span<double> speed, const RunControl& run) override;
  bool needs_components() const override { return true; }
  bool needs_normals() const override { return false; }
  /// A quarter of the time in which a ball of that area would be gone at the full speed: what is missing falls steadily.
  double max_step() const override;

 private:
  double goal_, speed_;
};

/// Holds the volume of every component that has a goal: takes out the mean of what the strategies before ask for and
/// adds what brings the volume back within the step (at most a quarter voxel). Give it last.
class HoldVolume final : public Strategy {
 public:
  std::string name() const override { return "volume"; }
  void add_speed(const SurfaceSamples& at, std::span<double> speed, const RunControl& run) override;
  bool needs_components() const override { return true; }
};

/// V = u·n: the surface is carried along by what moves, so that it does not lag behind its target.
class Carry final : public Strategy {
 public:
  /// `velocity` must outlive the strategy; the field's material velocity is asked for.
  explicit Carry(const field::Field& velocity) : field_(velocity) {}
  std::string name() const override { return "carry"; }
  void add_speed(const SurfaceSamples& at, std::span<double> speed, const RunControl& run) override;

 private:
  const field::Field& field_;
};

}  // namespace meniscus::band
