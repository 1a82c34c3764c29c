#include <meniscus/base/parallel.h>
#include <meniscus/motion/local_fit.h>
#include <meniscus/motion/rigid_fit.h>
#include <meniscus/points/neighbours.h>

#include <algorithm>
#include <cmath>

namespace meniscus::motion {
namespace {

/// Of singular values, relative to the largest one. A slide along the surface shows in v_n by the square of the patch's
/// radius over that of curvature only, for turning makes up for the rest.
constexpr double kSeen = 1e-4;

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

  Vec3 offset(const Patch& p, std::size_t j) const { return (points[j] - points[p.center]) / p.radius; }
  double unexplained(const Patch& p, const RigidMotion& motion) const;
  Vec3 velocity(const Patch& p, double& confidence) const;
};

double Fitter::unexplained(const Patch& p, const RigidMotion& motion) const {
  double left = 0;
  double all = 0;
  for (const std::uint32_t j : p.neighbours) {
    const double w = weight(p, j);
    left += w * std::pow(v.normal_speed[j] - v.normal[j].dot(motion.at(offset(p, j))), 2);
    all += w * v.velocity[j].squaredNorm();
  }
  return all > 0 ? std::sqrt(left / all) : 0;
}

Vec3 Fitter::velocity(const Patch& p, double& confidence) const {
  RigidMotion motion{v.velocity[p.center], {}};
  TurningFit turning;
  for (const std::uint32_t j : p.neighbours) turning.add(offset(p, j), v.velocity[j] - motion.u, weight(p, j));
  motion.turning = turning.solve();

  const RigidMotion guide = motion;
  const auto fit = [&](double unexplained) {
    NormalSpeedFit f;
    const auto add = [&](std::size_t j, double w) {
      const Vec3 r = offset(p, j);
      f.add(r, v.normal[j], v.normal_speed[j] - v.normal[j].dot(motion.at(r)), w);
    };
    add(p.center, 1);
    for (const std::uint32_t j : p.neighbours) add(j, weight(p, j));
    const NormalSpeedFit::Answer answer = f.solve(standing_out(unexplained, kSeen));
    motion.u += answer.change.u;
    motion.turning += answer.change.turning;
    confidence = answer.confidence;
  };
  fit(0);
  const double left = unexplained(p, motion);
  if (standing_out(left, kSeen).low > kSeen) motion = guide;
  fit(left);  // where nothing is left this takes away the rounding of the first
  const Vec3& n = v.normal[p.center];
  const Vec3& u = motion.u;
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
