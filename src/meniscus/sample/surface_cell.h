#pragma once

#include <meniscus/base/box.h>
#include <meniscus/sample/surface_points.h>

#include <array>
#include <cstdint>
#include <limits>
#include <span>

namespace meniscus::sample {

/// The Voronoi cell of one particle in its tangent plane, neighbours unrolled to their arc length. Area elements, empty
/// circles and Delaunay neighbours all come from it. An object is scratch space: build it for one particle after another.
class SurfaceCell {
 public:
  static constexpr std::int64_t kOpen = -1;    ///< side without a neighbour: the cell is cut off at `limit`
  static constexpr std::int64_t kBorder = -2;  ///< side on a face of the box

  /// Builds the cell of particle i from candidates that must include all within 2·limit on the same sheet (others are
  /// ignored), cut off at distance `limit` and at the faces of `box`.
  void build(const SurfacePoints& points, std::size_t i, std::span<const std::uint32_t> neighbours, double limit,
             const Box& box);

  /// Area of the tangent-plane cell; its error is about 5 % of |Gauss curvature|·area². See integrals.h.
  double area() const;
  /// Distance along the surface to the nearest neighbour on the same sheet; infinite when there is none.
  double nearest() const { return nearest_; }
  /// Some side has no neighbour: the particle has too few, or the surface ends.
  bool open() const;
  /// Distance to the farthest corner: the largest circle about a point of this cell that holds no particle.
  double farthest() const;
  /// That corner, in the tangent plane.
  Vec3 farthest_corner() const;
  Vec3 corner(int k) const;

  /// Share of a full cell: 1, or 1/2 for a particle on a face of the box (1/4 on an edge), whose cell ends there.
  double share() const { return share_; }

  int sides() const { return count_; }
  /// The neighbour behind each side in counter-clockwise order seen from outside; kOpen or kBorder otherwise.
  std::int64_t side(int k) const { return corner_[static_cast<std::size_t>(k)].side; }

 private:
  static constexpr int kMaxCorners = 40;
  struct Corner {
    double u, v;
    std::int64_t side;  // behind the edge from this corner to the next
  };
  struct Candidate {
    double distance, u, v;
    std::uint32_t index;
  };

  void take(const SurfacePoints& points, std::size_t i, std::span<const std::uint32_t> neighbours, double from, double to);
  void cut(double u, double v, double offset, std::int64_t side);
  void cut_box(const Box& box, double limit);
  double farthest2() const;

  Vec3 center_, axis_u_, axis_v_;
  std::array<Corner, kMaxCorners> corner_;
  int count_ = 0;
  double nearest_ = std::numeric_limits<double>::infinity();
  double share_ = 1;
  std::vector<Candidate> candidates_;
};

/// Two unit vectors that make a right-handed frame with n.
void tangent_frame(const Vec3& n, Vec3& u, Vec3& v);

}  // namespace meniscus::sample
