#include <meniscus/base/disjoint_sets.h>
#include <meniscus/motion/rigid_parts.h>

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

namespace meniscus::motion {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Of singular values, for a part that moves as one body. A sphere with bumps of a thousandth counts as one that turns
/// unseen.
constexpr double kSeen = 1e-3;
constexpr double kRigid = 1e-12;  // of a part's speed: nothing but rounding

}  // namespace

RigidParts::RigidParts(std::span<const Vec3> positions, std::span<const Triangle> triangles, std::span<const double> area,
                       const Velocities& v)
    : x_(positions), v_(v), part_(x_.size()), weight_(x_.size()), velocity_(x_.size()), excess_(x_.size()) {
  divide(triangles, area);
  place();
  follow_guide();
  follow_normal_speeds();
  weigh_excess();
  follow_normal_speeds();
  compare();
}

void RigidParts::divide(std::span<const Triangle> triangles, std::span<const double> area) {
  DisjointSets sets(x_.size());
  for (std::size_t f = 0; f < triangles.size(); ++f)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t i = triangles[f][k];
      sets.join(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(triangles[f][(k + 1) % 3]));
      if (v_.singular[static_cast<std::size_t>(i)] == 0) weight_[static_cast<std::size_t>(i)] += area[f] / 3;
    }
  for (std::size_t i = 0; i < x_.size(); ++i) {
    const std::uint32_t root = sets.root(static_cast<std::uint32_t>(i));  // the part's first vertex
    part_[i] = root == i ? static_cast<std::uint32_t>(parts_.size()) : part_[root];
    if (root == i) parts_.emplace_back();
  }
}

void RigidParts::place() {
  for (std::size_t i = 0; i < x_.size(); ++i) {
    parts_[part_[i]].weight += weight_[i];
    parts_[part_[i]].centre += weight_[i] * x_[i];
    parts_[part_[i]].motion.u += weight_[i] * v_.velocity[i];
  }
  for (Part& p : parts_) {
    if (!(p.weight > 0)) continue;
    p.centre /= p.weight;
    p.motion.u /= p.weight;
  }
  for (std::size_t i = 0; i < x_.size(); ++i)
    if (weight_[i] > 0)
      parts_[part_[i]].radius = std::max(parts_[part_[i]].radius, (x_[i] - parts_[part_[i]].centre).norm());
  for (Part& p : parts_)
    if (!(p.radius > 0)) p.radius = 1;
}

void RigidParts::follow_guide() {
  std::vector<TurningFit> fits(parts_.size());
  for (std::size_t i = 0; i < x_.size(); ++i)
    if (weight_[i] > 0) fits[part_[i]].add(offset(i), v_.velocity[i] - parts_[part_[i]].motion.u, weight_[i]);
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    if (parts_[p].weight > 0) parts_[p].motion.turning = fits[p].solve();
    parts_[p].guide = parts_[p].motion;
  }
}

void RigidParts::follow_normal_speeds() {
  std::vector<NormalSpeedFit> fits(parts_.size());
  for (std::size_t i = 0; i < x_.size(); ++i) {
    if (!(weight_[i] > 0)) continue;
    const Vec3 r = offset(i);
    fits[part_[i]].add(r, v_.normal[i], v_.normal_speed[i] - v_.normal[i].dot(parts_[part_[i]].motion.at(r)), weight_[i]);
  }
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    if (!(parts_[p].weight > 0)) continue;
    parts_[p].answer = fits[p].solve(standing_out(parts_[p].unexplained, kSeen));
    parts_[p].motion.u += parts_[p].answer.change.u;
    parts_[p].motion.turning += parts_[p].answer.change.turning;
  }
}

/// What no rigid motion explains. Where that is not rounding, directions that it hides are given back to the guide.
void RigidParts::weigh_excess() {
  std::vector<double> excess(parts_.size());
  std::vector<double> speed(parts_.size());
  for (std::size_t i = 0; i < x_.size(); ++i) {
    const Part& p = parts_[part_[i]];
    excess[part_[i]] += weight_[i] * std::pow(v_.normal_speed[i] - v_.normal[i].dot(p.motion.at(offset(i))), 2);
    speed[part_[i]] += weight_[i] * v_.velocity[i].squaredNorm();
  }
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    parts_[p].unexplained = speed[p] > 0 ? std::sqrt(excess[p] / speed[p]) : 0;
    if (standing_out(parts_[p].unexplained, kSeen).low > kSeen) parts_[p].motion = parts_[p].guide;
  }
}

void RigidParts::compare() {
  std::vector<double> speed(parts_.size());
  std::vector<double> most(parts_.size());
  for (std::size_t i = 0; i < x_.size(); ++i) {
    const bool counts = weight_[i] > 0;
    velocity_[i] = counts ? parts_[part_[i]].motion.at(offset(i)) : v_.velocity[i];
    if (counts) excess_[i] = v_.normal_speed[i] - v_.normal[i].dot(velocity_[i]);
    speed[part_[i]] = std::max(speed[part_[i]], velocity_[i].norm());
    most[part_[i]] = std::max(most[part_[i]], std::abs(excess_[i]));
  }
  for (std::size_t i = 0; i < x_.size(); ++i) {
    if (most[part_[i]] <= kRigid * speed[part_[i]]) excess_[i] = 0;
    if (excess_[i] != 0) all_rigid_ = false;
  }
}

void RigidParts::remove_untold(std::vector<Vec3>& tangential) const {
  struct Sums {
    Matrix6 matrix = Matrix6::Zero();
    Vector6 right = Vector6::Zero();
  };
  std::vector<Sums> sums(parts_.size());
  Eigen::Matrix<double, 3, 6> slides = Eigen::Matrix<double, 3, 6>::Zero();  // the doubtful motions at a vertex
  const auto slides_at = [&](std::size_t i) {
    const auto& answer = parts_[part_[i]].answer;
    const Vec3& n = v_.normal[i];
    slides.setZero();
    for (std::size_t k = 0; k < answer.doubtful; ++k) {
      const Vec3 u = answer.directions[k].at(offset(i));
      slides.col(static_cast<Eigen::Index>(k)) = u - n.dot(u) * n;
    }
  };
  for (std::size_t i = 0; i < x_.size(); ++i) {
    if (!(weight_[i] > 0) || parts_[part_[i]].answer.doubtful == 0) continue;
    slides_at(i);
    sums[part_[i]].matrix += weight_[i] * slides.transpose() * slides;
    sums[part_[i]].right += weight_[i] * slides.transpose() * tangential[i];
  }
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    const auto& answer = parts_[p].answer;
    for (Eigen::Index k = static_cast<Eigen::Index>(answer.doubtful); k < 6; ++k) sums[p].matrix(k, k) = 1;
    sums[p].right = sums[p].matrix.ldlt().solve(sums[p].right).eval();
    for (std::size_t k = 0; k < answer.doubtful; ++k) sums[p].right[static_cast<Eigen::Index>(k)] *= answer.doubt[k];
  }
  for (std::size_t i = 0; i < x_.size(); ++i) {
    if (!(weight_[i] > 0) || parts_[part_[i]].answer.doubtful == 0) continue;
    slides_at(i);
    tangential[i] -= slides * sums[part_[i]].right;
  }
}

}  // namespace meniscus::motion
