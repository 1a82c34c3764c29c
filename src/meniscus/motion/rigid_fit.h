#pragma once

#include <meniscus/base/vec.h>
#include <meniscus/motion/regular.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cstddef>

namespace meniscus::motion {

/// A rigid motion: velocity `u + turning × offset`, offsets from a centre in a unit of length that the caller chooses so
/// that both parts weigh alike (the radius of the patch or body); world units per second, both.
struct RigidMotion {
  Vec3 u = Vec3::Zero();
  Vec3 turning = Vec3::Zero();  ///< radians per second times the unit of length

  Vec3 at(const Vec3& offset) const { return u + turning.cross(offset); }
};

/// The turning about the centre that suits velocities, relative to the centre's, best by weighted least squares.
class TurningFit {
 public:
  void add(const Vec3& offset, const Vec3& velocity, double weight);
  /// Zero about directions that the offsets leave open.
  Vec3 solve() const;

 private:
  Mat3 matrix_ = Mat3::Zero();
  Vec3 right_ = Vec3::Zero();
};

/// The rigid motion that suits the normal speeds of points of a surface best, by weighted least squares, as a correction of
/// a guide: directions among motions that normal speeds do not tell (turning a sphere, sliding along a cylinder) are left to
/// it.
class NormalSpeedFit {
 public:
  /// A point moves along its unit `normal` at `excess` more than the guide's motion.
  void add(const Vec3& offset, const Vec3& normal, double excess, double weight);
  struct Answer {
    RigidMotion change;     ///< what to add to the guide
    double confidence = 0;  ///< least trust in a direction that moves the centre
    std::size_t doubtful = 0;
    std::array<RigidMotion, 6> directions;  ///< the first `doubtful`: those that are not trusted wholly
    std::array<double, 6> doubt{};          ///< of each of them: 1 less its trust
  };
  /// A direction counts as much as `trust` says of its singular value relative to the largest.
  Answer solve(const Regular& trust) const;

 private:
  Eigen::Matrix<double, 6, 6> matrix_ = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> right_ = Eigen::Matrix<double, 6, 1>::Zero();
};

/// How far to trust directions among motions, by singular value relative to the largest: as far as they stand out of what no
/// rigid motion explains. `unexplained` is the root mean square of the normal speeds that remain, relative to that of the
/// speeds; a motion of singular value s that noise feigns is unexplained/s as fast as the points are. `least`: what rounding
/// allows.
inline Regular standing_out(double unexplained, double least) {
  constexpr double kHidden = 0.3;
  constexpr double kSure = 10;
  const double low = std::max(least, kHidden * unexplained);
  return {low, kSure * low};
}

}  // namespace meniscus::motion
