#pragma once

#include <meniscus/motion/rigid_fit.h>
#include <meniscus/motion/velocity.h>

#include <cstdint>
#include <span>
#include <vector>

namespace meniscus::motion {

/// The parts of a mesh as bodies: each has the rigid motion that suits its normal speeds best. Vertices belong together that
/// triangles connect. Motions of a part that normal speeds do not tell (turning a sphere) follow the given velocities, best
/// by least squares. Singular vertices count for nothing and have no excess. Deterministic, linear cost.
class RigidParts {
 public:
  /// `triangles` are those that hold, `area` their areas. `positions` and `v` must live as long as this.
  RigidParts(std::span<const Vec3> positions, std::span<const Triangle> triangles, std::span<const double> area,
             const Velocities& v);

  /// Of every vertex's part, there; world units per second.
  const std::vector<Vec3>& velocity() const { return velocity_; }
  /// Normal speed beyond that: exactly 0 all over a part that moves as one body.
  const std::vector<double>& excess() const { return excess_; }
  /// Whether every excess is 0.
  bool all_rigid() const { return all_rigid_; }
  /// Takes out of tangential velocities whatever moves parts in ways that normal speeds do not tell.
  void remove_untold(std::vector<Vec3>& tangential) const;

 private:
  struct Part {
    double weight = 0;
    Vec3 centre = Vec3::Zero();
    double radius = 0;
    RigidMotion guide, motion;
    double unexplained = 0;  // normal speed, relative to speed
    NormalSpeedFit::Answer answer;
  };
  void divide(std::span<const Triangle> triangles, std::span<const double> area);
  void place();
  void follow_guide();
  void follow_normal_speeds();
  void weigh_excess();
  void compare();
  Vec3 offset(std::size_t i) const { return (x_[i] - parts_[part_[i]].centre) / parts_[part_[i]].radius; }

  std::span<const Vec3> x_;
  const Velocities& v_;
  std::vector<std::uint32_t> part_;  // of every vertex
  std::vector<double> weight_;       // of every vertex: its area
  std::vector<Part> parts_;
  std::vector<Vec3> velocity_;
  std::vector<double> excess_;
  bool all_rigid_ = true;
};

}  // namespace meniscus::motion
