#include <meniscus/motion/rigid_fit.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace meniscus::motion {

void TurningFit::add(const Vec3& offset, const Vec3& velocity, double weight) {
  matrix_ += weight * (offset.squaredNorm() * Mat3::Identity() - offset * offset.transpose());
  right_ += weight * offset.cross(velocity);
}

Vec3 TurningFit::solve() const {
  Mat3 matrix = matrix_;
  matrix.diagonal().array() += 1e-12 * matrix.trace() + 1e-300;  // offsets in a line leave the turning about it open
  return matrix.ldlt().solve(right_);
}

void NormalSpeedFit::add(const Vec3& offset, const Vec3& normal, double excess, double weight) {
  Eigen::Matrix<double, 6, 1> row;
  row << normal, offset.cross(normal);
  matrix_.selfadjointView<Eigen::Lower>().rankUpdate(row, weight);  // all that the solver reads
  right_ += weight * excess * row;
}

NormalSpeedFit::Answer NormalSpeedFit::solve(const Regular& trust) const {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> eigen(matrix_);
  const double largest = eigen.eigenvalues()[5];
  Answer answer;
  answer.confidence = largest > 0 ? 1 : 0;
  for (Eigen::Index k = 0; k < 6 && largest > 0; ++k) {
    const double value = eigen.eigenvalues()[k];
    const double share = value > 0 ? trust(std::sqrt(value / largest)) : 0;
    const Eigen::Matrix<double, 6, 1> direction = eigen.eigenvectors().col(k);
    // A direction that only turns the points about the centre does not matter there.
    if (direction.head<3>().norm() > 1e-6) answer.confidence = std::min(answer.confidence, share);
    if (share < 1) {
      answer.directions[answer.doubtful] = {direction.head<3>(), direction.tail<3>()};
      answer.doubt[answer.doubtful++] = 1 - share;
    }
    if (!(share > 0)) continue;
    const double length = share * direction.dot(right_) / value;
    answer.change.u += length * direction.head<3>();
    answer.change.turning += length * direction.tail<3>();
  }
  return answer;
}

}  // namespace meniscus::motion
