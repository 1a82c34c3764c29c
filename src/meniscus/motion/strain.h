#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/base/vec.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace meniscus::motion {

/// The triangles of a mesh that resist strain: those that have a plane and hold no crease.
struct Resisting {
  std::vector<Triangle> triangles;
  std::vector<double> area;
};

/// A triangle whose corners' unit `normals` are over 60° apart holds a crease: what is on either side of it moves as it
/// likes. Indices must be in range.
Resisting resisting(std::span<const Vec3> positions, std::span<const Vec3> normals, std::span<const Triangle> triangles);

/// Two unit vectors per vertex that span its tangent plane.
struct TangentFrames {
  std::vector<Vec3> first, second;
};

/// Frames whose first vector points to the vertex `towards[i]`, as far as it can: seen in them, a mesh that moves as one
/// body does not change.
TangentFrames tangent_frames(std::span<const Vec3> positions, std::span<const Vec3> normals,
                             std::span<const std::int32_t> towards);

/// A triangle's rate of strain within its plane (xx, yy and √2 xy, so that the squares add up to the tensor's norm) as a
/// function of the tangential velocities at its corners: vectors of two numbers per vertex, in its frame.
struct Strain {
  using Vector = Eigen::VectorXd;
  using Corners = Eigen::Matrix<double, 6, 1>;

  std::array<Eigen::Index, 3> corner;
  Eigen::Matrix<double, 3, 6> rows;
  Vec3 constant;
  double weight;  ///< area

  Corners gather(const Vector& t) const {
    Corners c;
    for (std::size_t k = 0; k < 3; ++k) c.segment<2>(2 * static_cast<Eigen::Index>(k)) = t.segment<2>(2 * corner[k]);
    return c;
  }
  void scatter(const Corners& c, Vector& t) const {
    for (std::size_t k = 0; k < 3; ++k) t.segment<2>(2 * corner[k]) += c.segment<2>(2 * static_cast<Eigen::Index>(k));
  }
  Vec3 of(const Vector& t) const { return rows * gather(t) + constant; }
};

/// The strain of every resisting triangle; the constant parts are those of normal `speeds` (empty: none).
std::vector<Strain> strains(const Resisting& mesh, std::span<const Vec3> positions, std::span<const Vec3> normals,
                            std::span<const double> speeds, const TangentFrames& frames, const RunControl& run);

}  // namespace meniscus::motion
