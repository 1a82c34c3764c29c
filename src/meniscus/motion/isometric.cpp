#include <meniscus/base/error.h>
#include <meniscus/motion/isometric.h>

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>

#include <array>
#include <cmath>

namespace meniscus::motion {
namespace {

constexpr double kGuide = 1e-5;  // weight of the guide, relative to strain
constexpr int kRounds = 4;       // of iterated regularisation: a bias b becomes b⁴
constexpr double kRounding = 1e-14;
constexpr double kCrease = 0.5;  // cosine between normals of a triangle's corners, from where on there is a crease in it

using Sparse = Eigen::SparseMatrix<double>;
using Vector = Eigen::VectorXd;

using Local = Eigen::Matrix<double, 6, 1>;

/// A triangle's strain rate within its plane (xx, yy and √2 xy, so that the squares add up to the tensor's norm) as a
/// function of the tangential velocities at its corners.
struct Strain {
  std::array<Eigen::Index, 3> corner;
  Eigen::Matrix<double, 3, 6> rows;
  Vec3 constant;
  double weight;

  Local local(const Vector& t) const {
    Local l;
    for (std::size_t k = 0; k < 3; ++k) l.segment<2>(2 * static_cast<Eigen::Index>(k)) = t.segment<2>(2 * corner[k]);
    return l;
  }
  Vec3 of(const Vector& t) const { return rows * local(t) + constant; }
  void add_to(Vector& v, const Local& l) const {
    for (std::size_t k = 0; k < 3; ++k) v.segment<2>(2 * corner[k]) += l.segment<2>(2 * static_cast<Eigen::Index>(k));
  }
};

bool creased(const Velocities& v, const std::array<std::size_t, 3>& corner) {
  for (std::size_t k = 0; k < 3; ++k)
    if (v.normal[corner[k]].dot(v.normal[corner[(k + 1) % 3]]) < kCrease) return true;
  return false;
}

}  // namespace

struct IsometricSolver::State {
  std::vector<Triangle> triangles;
  std::size_t vertices = 0;
  Eigen::SimplicialLDLT<Sparse> factor;
  bool analysed = false;

  std::vector<Strain> strains(std::span<const Vec3> x, const Velocities& v) const;
  std::vector<double> guide_weights(const std::vector<Strain>& strains) const;
  Sparse matrix(const std::vector<Strain>& strains) const;
};

IsometricSolver::IsometricSolver(const mesh::Mesh& mesh) : state_(std::make_unique<State>()) {
  const auto n = static_cast<std::int32_t>(mesh.positions.size());
  for (const Triangle& t : mesh.triangles)
    for (const std::int32_t i : t)
      if (i < 0 || i >= n) throw InvalidInput("a triangle's index is out of range");
  state_->vertices = mesh.positions.size();
  state_->triangles = mesh.triangles;
}

IsometricSolver::~IsometricSolver() = default;
IsometricSolver::IsometricSolver(IsometricSolver&&) noexcept = default;
IsometricSolver& IsometricSolver::operator=(IsometricSolver&&) noexcept = default;

std::vector<Strain> IsometricSolver::State::strains(std::span<const Vec3> x, const Velocities& v) const {
  std::vector<Strain> list(triangles.size());
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    Strain& s = list[f];
    std::array<std::size_t, 3> index;
    for (std::size_t k = 0; k < 3; ++k) {
      index[k] = static_cast<std::size_t>(triangles[f][k]);
      s.corner[k] = triangles[f][k];
    }
    s.rows.setZero();
    s.constant.setZero();
    const Vec3 e = x[index[1]] - x[index[0]];
    const Vec3 d = x[index[2]] - x[index[0]];
    const double doubled = e.cross(d).norm();
    s.weight = doubled / 2;
    if (!(doubled > 1e-12 * (e.squaredNorm() + d.squaredNorm()))) continue;  // a needle has no plane
    if (creased(v, index)) continue;                                         // either side moves as it likes
    const Vec3 u = e.normalized();
    const Vec3 w = (d - u.dot(d) * u).normalized();
    const Vec2 p[3] = {{0, 0}, {e.norm(), 0}, {u.dot(d), w.dot(d)}};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2 opposite = p[(k + 2) % 3] - p[(k + 1) % 3];
      const Vec2 slope = Vec2(-opposite.y(), opposite.x()) / doubled;  // of the function that is 1 at this corner
      const auto strain = [&](const Vec3& velocity) {
        const double a = u.dot(velocity);
        const double b = w.dot(velocity);
        return Vec3(a * slope.x(), b * slope.y(), (a * slope.y() + b * slope.x()) / std::sqrt(2.0));
      };
      const std::size_t i = index[k];
      Vec3 first, second;
      tangents(v.normal[i], first, second);
      s.rows.col(2 * static_cast<Eigen::Index>(k)) = strain(first);
      s.rows.col(2 * static_cast<Eigen::Index>(k) + 1) = strain(second);
      s.constant += strain(v.normal_speed[i] * v.normal[i]);
    }
  }
  return list;
}

std::vector<double> IsometricSolver::State::guide_weights(const std::vector<Strain>& strains) const {
  std::vector<double> weights(vertices);
  double total = 0;
  for (const Strain& s : strains) {
    total += s.weight;
    for (const Eigen::Index i : s.corner) weights[static_cast<std::size_t>(i)] += s.weight / 3;
  }
  // The floor is for vertices without area.
  for (double& w : weights) w = total > 0 ? kGuide * (w / total + 1e-6 / static_cast<double>(vertices)) : 1;
  return weights;
}

Sparse IsometricSolver::State::matrix(const std::vector<Strain>& strains) const {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(21 * strains.size() + 2 * vertices);
  for (const Strain& s : strains) {
    const Eigen::Matrix<double, 6, 6> block = s.weight * s.rows.transpose() * s.rows;
    for (Eigen::Index i = 0; i < 6; ++i)
      for (Eigen::Index j = 0; j < 6; ++j) {
        const Eigen::Index row = 2 * s.corner[static_cast<std::size_t>(i / 2)] + i % 2;
        const Eigen::Index column = 2 * s.corner[static_cast<std::size_t>(j / 2)] + j % 2;
        if (row >= column) entries.emplace_back(row, column, block(i, j));
      }
  }
  const std::vector<double> weights = guide_weights(strains);
  const auto size = static_cast<Eigen::Index>(2 * vertices);
  for (Eigen::Index i = 0; i < size; ++i) entries.emplace_back(i, i, weights[static_cast<std::size_t>(i / 2)]);
  Sparse result(size, size);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

double IsometricSolver::solve(std::span<const Vec3> positions, Velocities& v, const RunControl& run) {
  State& s = *state_;
  if (positions.size() != s.vertices || v.velocity.size() != s.vertices)
    throw InvalidInput("the velocities are not those of the mesh");
  if (s.vertices == 0) return 0;
  const auto n = static_cast<Eigen::Index>(s.vertices);
  const std::vector<Strain> strains = s.strains(positions, v);
  run.check();
  const Sparse matrix = s.matrix(strains);
  if (!s.analysed) s.factor.analyzePattern(matrix);
  s.analysed = true;
  s.factor.factorize(matrix);
  run.check();

  Vector t(2 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    Vec3 a, b;
    tangents(v.normal[k], a, b);
    t[2 * i] = a.dot(v.velocity[k]);
    t[2 * i + 1] = b.dot(v.velocity[k]);
  }
  bool good = s.factor.info() == Eigen::Success;
  for (int round = 0; round < kRounds && good; ++round) {
    Vector residual = Vector::Zero(2 * n);
    Vector size = Vector::Zero(2 * n);
    for (const Strain& e : strains) {
      e.add_to(residual, -e.weight * (e.rows.transpose() * e.of(t)));
      const Vec3 most = e.constant.cwiseAbs() + e.rows.cwiseAbs() * e.local(t).cwiseAbs();
      e.add_to(size, e.weight * (e.rows.cwiseAbs().transpose() * most));
    }
    // Nothing but rounding left: solving for it would only feed it into the directions that strain leaves open.
    if (residual.norm() <= kRounding * size.norm()) break;
    t += s.factor.solve(residual);
    good = t.allFinite();
  }
  double strain = 0;
  double total = 0;
  for (const Strain& e : strains) {
    strain += e.weight * e.of(t).squaredNorm();
    total += e.weight;
  }
  for (std::size_t i = 0; i < s.vertices; ++i) {
    if (!good) v.confidence[i] = 0;
    if (!good || v.singular[i] != 0) continue;
    Vec3 a, b;
    tangents(v.normal[i], a, b);
    const auto k = static_cast<Eigen::Index>(2 * i);
    v.velocity[i] = v.normal_speed[i] * v.normal[i] + t[k] * a + t[k + 1] * b;
  }
  return good && total > 0 ? std::sqrt(strain / total) : 0;
}

}  // namespace meniscus::motion
