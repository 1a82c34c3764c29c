#include <meniscus/base/parallel.h>
#include <meniscus/motion/local_fit.h>
#include <meniscus/motion/regular.h>
#include <meniscus/points/neighbours.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace meniscus::motion {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Of singular values, relative to the largest one. A slide along the surface shows in v_n by the square of the patch's
/// radius over that of curvature only, for turning makes up for the rest.
constexpr Regular kFit{5e-4, 5e-3};

/// A point and those it is fitted with.
struct Patch {
  std::size_t center;
  std::span<const std::uint32_t> neighbours;
  double radius;  // unit of the turning part, so that both parts of a motion weigh alike
};

struct Fitter {
  std::span<const Vec3> points;
  const Velocities& v;

  double weight(const Patch& p, std::size_t j) const {
    if (v.singular[j] != 0) return 0;
    const double agreement = v.normal[p.center].dot(v.normal[j]);
    // Nothing at the rim: which of several neighbours at one distance is the last does not matter.
    const double fade = 1 - (points[j] - points[p.center]).squaredNorm() / (p.radius * p.radius);
    return agreement > 0 && fade > 0 ? agreement * fade * fade : 0;
  }

  /// The turning that suits the neighbours' present velocities, about the point's own.
  Vec3 turning(const Patch& p) const {
    Mat3 matrix = Mat3::Zero();
    Vec3 right = Vec3::Zero();
    for (const std::uint32_t j : p.neighbours) {
      const double w = weight(p, j);
      const Vec3 r = (points[j] - points[p.center]) / p.radius;
      matrix += w * (r.squaredNorm() * Mat3::Identity() - r * r.transpose());
      right += w * r.cross(v.velocity[j] - v.velocity[p.center]);
    }
    matrix.diagonal().array() += 1e-12 * matrix.trace() + 1e-300;  // neighbours in a line leave the turning about it open
    return matrix.ldlt().solve(right);
  }

  Vec3 velocity(const Patch& p, double& confidence) const;
};

Vec3 Fitter::velocity(const Patch& p, double& confidence) const {
  Vector6 motion;
  motion << v.velocity[p.center], turning(p);
  Matrix6 matrix = Matrix6::Zero();
  Vector6 right = Vector6::Zero();
  const auto add = [&](std::size_t j, double w) {
    const Vec3 r = (points[j] - points[p.center]) / p.radius;
    Vector6 row;
    row << v.normal[j], r.cross(v.normal[j]);
    matrix += w * row * row.transpose();
    right += w * (v.normal_speed[j] - row.dot(motion)) * row;
  };
  add(p.center, 1);
  for (const std::uint32_t j : p.neighbours) add(j, weight(p, j));

  const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(matrix);
  const double largest = eigen.eigenvalues()[5];
  confidence = largest > 0 ? 1 : 0;
  for (Eigen::Index k = 0; k < 6 && largest > 0; ++k) {
    const double value = eigen.eigenvalues()[k];
    const double trust = value > 0 ? kFit(std::sqrt(value / largest)) : 0;
    const Vector6 direction = eigen.eigenvectors().col(k);
    // A direction that only turns the patch about the point does not matter to the point.
    if (direction.head<3>().norm() > 1e-6) confidence = std::min(confidence, trust);
    if (trust > 0) motion += trust * (direction.dot(right) / value) * direction;
  }
  const Vec3& n = v.normal[p.center];
  const Vec3 u = motion.head<3>();
  return u + (v.normal_speed[p.center] - n.dot(u)) * n;
}

}  // namespace

void fit_rigid_motions(std::span<const Vec3> points, std::size_t count, Velocities& v, const RunControl& run) {
  const points::NeighbourLists lists = points::nearest_neighbours(points, count, run);
  std::vector<Vec3> fitted(v.velocity);
  std::vector<double> confidence(v.confidence);
  const Fitter fitter{points, v};
  parallel_for(points.size(), 64, run, [&](std::size_t i) {
    if (v.singular[i] != 0) return;
    const auto neighbours = lists.of(i);
    const double radius = neighbours.empty() ? 0 : (points[neighbours.back()] - points[i]).norm();
    if (!(radius > 0)) {
      confidence[i] = 0;
      return;
    }
    fitted[i] = fitter.velocity({i, neighbours, radius}, confidence[i]);
  });
  v.velocity.swap(fitted);
  v.confidence.swap(confidence);
}

}  // namespace meniscus::motion
