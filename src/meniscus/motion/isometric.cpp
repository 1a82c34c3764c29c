#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>
#include <meniscus/motion/isometric.h>

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>

#include <array>
#include <cmath>
#include <numeric>
#include <optional>

namespace meniscus::motion {
namespace {

constexpr double kGuide = 1e-5;      // weight of the guide, relative to strain
constexpr int kRounds = 4;           // of iterated regularisation: a bias b becomes b⁴
constexpr int kIterations = 3;       // more are needed in a round: the factorisation is of another shape
constexpr double kConverged = 1e-8;  // of the first correction, by energy
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

bool creased(std::span<const Vec3> normals, const std::array<std::size_t, 3>& corner) {
  for (std::size_t k = 0; k < 3; ++k)
    if (normals[corner[k]].dot(normals[corner[(k + 1) % 3]]) < kCrease) return true;
  return false;
}

/// Two unit vectors per vertex that span the tangent plane and turn with the mesh: seen in them, a shape that moves as one
/// body does not change.
struct Frames {
  std::vector<Vec3> first, second;
};

}  // namespace

struct IsometricSolver::State {
  std::vector<Triangle> triangles;
  std::size_t vertices = 0;
  std::vector<std::int32_t> neighbour;  // of each vertex one; itself if it has none
  Shape shape;                          // where the factorisation was made
  Eigen::SimplicialLDLT<Sparse> factor;
  bool analysed = false;
  bool factorised = false;

  Frames frames(std::span<const Vec3> x, std::span<const Vec3> normals) const;
  /// Without `speeds` the constant parts are zero.
  std::vector<Strain> strains(std::span<const Vec3> x, std::span<const Vec3> normals, std::span<const double> speeds,
                              const Frames& frames, const RunControl& run) const;
  std::vector<double> guide_weights(const std::vector<Strain>& strains) const;
  Sparse matrix(const std::vector<Strain>& strains) const;
  bool factorise();
  std::optional<Vector> regularised(const std::vector<Strain>& strains, const std::vector<double>& weights,
                                    Vector right) const;
  bool improve(const std::vector<Strain>& strains, Vector& t) const;
};

IsometricSolver::IsometricSolver(const mesh::Mesh& mesh) : state_(std::make_unique<State>()) {
  const auto n = static_cast<std::int32_t>(mesh.positions.size());
  for (const Triangle& t : mesh.triangles)
    for (const std::int32_t i : t)
      if (i < 0 || i >= n) throw InvalidInput("a triangle's index is out of range");
  state_->vertices = mesh.positions.size();
  state_->triangles = mesh.triangles;
  state_->neighbour.resize(mesh.positions.size());
  std::iota(state_->neighbour.begin(), state_->neighbour.end(), 0);
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) state_->neighbour[static_cast<std::size_t>(t[k])] = t[(k + 1) % 3];
}

IsometricSolver::~IsometricSolver() = default;
IsometricSolver::IsometricSolver(IsometricSolver&&) noexcept = default;
IsometricSolver& IsometricSolver::operator=(IsometricSolver&&) noexcept = default;

const IsometricSolver::Shape& IsometricSolver::factorised_at() const { return state_->shape; }

void IsometricSolver::factorise(Shape shape) {
  if (shape.positions.size() != state_->vertices || shape.normals.size() != state_->vertices)
    throw InvalidInput("the shape is not that of the mesh");
  state_->shape = std::move(shape);
  state_->factorise();
}

Frames IsometricSolver::State::frames(std::span<const Vec3> x, std::span<const Vec3> normals) const {
  Frames f{std::vector<Vec3>(vertices), std::vector<Vec3>(vertices)};
  for (std::size_t i = 0; i < vertices; ++i) {
    const Vec3& n = normals[i];
    const Vec3 edge = x[static_cast<std::size_t>(neighbour[i])] - x[i];
    const Vec3 flat = edge - n.dot(edge) * n;
    if (flat.squaredNorm() > 1e-6 * edge.squaredNorm()) {
      f.first[i] = flat.normalized();
      f.second[i] = n.cross(f.first[i]);
    } else {
      tangents(n, f.first[i], f.second[i]);
    }
  }
  return f;
}

std::vector<Strain> IsometricSolver::State::strains(std::span<const Vec3> x, std::span<const Vec3> normals,
                                                    std::span<const double> speeds, const Frames& frames,
                                                    const RunControl& run) const {
  std::vector<Strain> list(triangles.size());
  parallel_for(triangles.size(), 256, run, [&](std::size_t f) {
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
    if (!(doubled > 1e-12 * (e.squaredNorm() + d.squaredNorm()))) return;  // a needle has no plane
    if (creased(normals, index)) return;                                   // either side moves as it likes
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
      s.rows.col(2 * static_cast<Eigen::Index>(k)) = strain(frames.first[i]);
      s.rows.col(2 * static_cast<Eigen::Index>(k) + 1) = strain(frames.second[i]);
      if (!speeds.empty()) s.constant += strain(speeds[i] * normals[i]);
    }
  });
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

bool IsometricSolver::State::factorise() {
  const Frames f = frames(shape.positions, shape.normals);
  const Sparse m = matrix(strains(shape.positions, shape.normals, {}, f, {}));
  if (!analysed) factor.analyzePattern(m);
  analysed = true;
  factor.factorize(m);
  factorised = factor.info() == Eigen::Success;
  return factorised;
}

/// Solves (strain + guide) x = right by preconditioned conjugate gradients; nothing if that takes too many iterations.
std::optional<Vector> IsometricSolver::State::regularised(const std::vector<Strain>& strains,
                                                          const std::vector<double>& weights, Vector right) const {
  Vector x = Vector::Zero(right.size());
  Vector direction = x;
  double before = 0;
  double first = 0;
  for (int k = 0; k <= kIterations; ++k) {
    const Vector step = factor.solve(right);
    const double energy = right.dot(step);
    if (k == 0) first = energy;
    if (!(energy > kConverged * kConverged * first)) return x;
    direction = step + (k == 0 ? 0 : energy / before) * direction;
    before = energy;
    Vector image(x.size());
    for (Eigen::Index i = 0; i < x.size(); ++i) image[i] = weights[static_cast<std::size_t>(i / 2)] * direction[i];
    for (const Strain& e : strains) e.add_to(image, e.weight * (e.rows.transpose() * (e.rows * e.local(direction))));
    const double length = energy / direction.dot(image);
    x += length * direction;
    right -= length * image;
  }
  return std::nullopt;
}

/// Iterated Tikhonov regularisation from t on. False if the factorisation is of too different a shape.
bool IsometricSolver::State::improve(const std::vector<Strain>& strains, Vector& t) const {
  const std::vector<double> weights = guide_weights(strains);
  for (int round = 0; round < kRounds; ++round) {
    Vector residual = Vector::Zero(t.size());
    Vector size = Vector::Zero(t.size());
    for (const Strain& e : strains) {
      e.add_to(residual, -e.weight * (e.rows.transpose() * e.of(t)));
      const Vec3 most = e.constant.cwiseAbs() + e.rows.cwiseAbs() * e.local(t).cwiseAbs();
      e.add_to(size, e.weight * (e.rows.cwiseAbs().transpose() * most));
    }
    // Nothing but rounding left: solving for it would only feed it into the directions that strain leaves open.
    if (residual.norm() <= kRounding * size.norm()) return true;
    const auto correction = regularised(strains, weights, std::move(residual));
    if (!correction) return false;
    t += *correction;
  }
  return true;
}

double IsometricSolver::solve(std::span<const Vec3> positions, Velocities& v, const RunControl& run) {
  State& s = *state_;
  if (positions.size() != s.vertices || v.velocity.size() != s.vertices)
    throw InvalidInput("the velocities are not those of the mesh");
  if (s.vertices == 0) return 0;
  const auto n = static_cast<Eigen::Index>(s.vertices);
  const Frames frames = s.frames(positions, v.normal);
  const std::vector<Strain> strains = s.strains(positions, v.normal, v.normal_speed, frames, run);
  Vector guide(2 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    guide[2 * i] = frames.first[k].dot(v.velocity[k]);
    guide[2 * i + 1] = frames.second[k].dot(v.velocity[k]);
  }
  run.check();
  Vector t = guide;
  bool good = s.factorised && s.improve(strains, t);
  if (!good) {
    s.shape = {{positions.begin(), positions.end()}, v.normal};
    t = guide;
    good = s.factorise();
    run.check();
    good = good && s.improve(strains, t);
  }
  good = good && t.allFinite();
  double strain = 0;
  double total = 0;
  for (const Strain& e : strains) {
    strain += e.weight * e.of(t).squaredNorm();
    total += e.weight;
  }
  for (std::size_t i = 0; i < s.vertices; ++i) {
    if (!good) v.confidence[i] = 0;
    if (!good || v.singular[i] != 0) continue;
    const auto k = static_cast<Eigen::Index>(2 * i);
    v.velocity[i] = v.normal_speed[i] * v.normal[i] + t[k] * frames.first[i] + t[k + 1] * frames.second[i];
  }
  return good && total > 0 ? std::sqrt(strain / total) : 0;
}

}  // namespace meniscus::motion
