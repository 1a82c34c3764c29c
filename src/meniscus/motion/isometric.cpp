#include <meniscus/base/error.h>
#include <meniscus/mesh/adjacency.h>
#include <meniscus/motion/isometric.h>

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>

#include <algorithm>
#include <array>
#include <cmath>

namespace meniscus::motion {
namespace {

constexpr double kGuide = 1e-5;  // weight of the guide, relative to strain
constexpr int kRounds = 4;       // of iterated regularisation: a bias b becomes b⁴
constexpr double kRounding = 1e-14;

using Sparse = Eigen::SparseMatrix<double>;
using Vector = Eigen::VectorXd;

/// One edge's strain rate as a function of the tangential velocities at its ends: first·a_i + second·a_j + constant.
struct Strain {
  Eigen::Index a, b;
  Vec2 first, second;
  double constant;
  double weight;

  double of(const Vector& t) const { return first.dot(t.segment<2>(2 * a)) + second.dot(t.segment<2>(2 * b)) + constant; }
};

}  // namespace

struct IsometricSolver::State {
  std::vector<mesh::Edge> edges;
  std::vector<Triangle> triangles;
  std::vector<std::array<std::size_t, 3>> sides;  // the edges of each triangle
  std::size_t vertices = 0;
  Eigen::SimplicialLDLT<Sparse> factor;
  bool analysed = false;

  std::vector<double> edge_weights(std::span<const Vec3> x, std::vector<double>& vertex_weights) const;
  std::vector<Strain> strains(std::span<const Vec3> x, const Velocities& v, const std::vector<double>& weights) const;
  Sparse matrix(const std::vector<Strain>& strains, const std::vector<double>& vertex_weights) const;
};

IsometricSolver::IsometricSolver(const mesh::Mesh& mesh) : state_(std::make_unique<State>()) {
  const auto n = static_cast<std::int32_t>(mesh.positions.size());
  for (const Triangle& t : mesh.triangles)
    for (const std::int32_t i : t)
      if (i < 0 || i >= n) throw InvalidInput("a triangle's index is out of range");
  state_->vertices = mesh.positions.size();
  state_->edges = mesh::edges(mesh);
  state_->triangles = mesh.triangles;
  const auto& edges = state_->edges;
  const auto find = [&](std::int32_t i, std::int32_t j) {
    const auto key = std::minmax(i, j);
    const auto at = std::lower_bound(edges.begin(), edges.end(), key, [](const mesh::Edge& e, const auto& k) {
      return e.a != k.first ? e.a < k.first : e.b < k.second;
    });
    return static_cast<std::size_t>(at - edges.begin());
  };
  state_->sides.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) state_->sides.push_back({find(t[0], t[1]), find(t[1], t[2]), find(t[2], t[0])});
}

IsometricSolver::~IsometricSolver() = default;
IsometricSolver::IsometricSolver(IsometricSolver&&) noexcept = default;
IsometricSolver& IsometricSolver::operator=(IsometricSolver&&) noexcept = default;

std::vector<double> IsometricSolver::State::edge_weights(std::span<const Vec3> x,
                                                         std::vector<double>& vertex_weights) const {
  std::vector<double> weights(edges.size());
  vertex_weights.assign(vertices, 0);
  double total = 0;
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    const auto corner = [&](std::size_t k) { return x[static_cast<std::size_t>(triangles[f][k])]; };
    const double area = 0.5 * (corner(1) - corner(0)).cross(corner(2) - corner(0)).norm();
    total += area;
    for (std::size_t k = 0; k < 3; ++k) {
      if (sides[f][k] < weights.size()) weights[sides[f][k]] += area / 3;
      vertex_weights[static_cast<std::size_t>(triangles[f][k])] += area / 3;
    }
  }
  // Units: areas by the mean area of a vertex, so that neither size nor fineness matters to rounding.
  const double unit = total > 0 ? static_cast<double>(vertices) / total : 0;
  for (double& w : weights) w *= unit;
  for (double& w : vertex_weights) w = (w * unit + 1e-6) * kGuide / (total > 0 ? total : 1);
  return weights;
}

std::vector<Strain> IsometricSolver::State::strains(std::span<const Vec3> x, const Velocities& v,
                                                    const std::vector<double>& weights) const {
  std::vector<Strain> list(edges.size());
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const auto i = static_cast<std::size_t>(edges[k].a);
    const auto j = static_cast<std::size_t>(edges[k].b);
    const Vec3 e = x[j] - x[i];
    const double squared = e.squaredNorm();
    Vec3 s[2], t[2];
    tangents(v.normal[i], s[0], t[0]);
    tangents(v.normal[j], s[1], t[1]);
    const Vec3 rate = squared > 0 ? Vec3(e / squared) : Vec3(Vec3::Zero());
    list[k] = {static_cast<Eigen::Index>(i),
               static_cast<Eigen::Index>(j),
               {-rate.dot(s[0]), -rate.dot(t[0])},
               {rate.dot(s[1]), rate.dot(t[1])},
               rate.dot(v.normal_speed[j] * v.normal[j] - v.normal_speed[i] * v.normal[i]),
               weights[k]};
  }
  return list;
}

Sparse IsometricSolver::State::matrix(const std::vector<Strain>& strains, const std::vector<double>& vertex_weights) const {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(10 * strains.size() + 3 * vertices);
  const auto add = [&](Eigen::Index r, Eigen::Index c, const Vec2& p, const Vec2& q, double w) {
    for (Eigen::Index i = 0; i < 2; ++i)
      for (Eigen::Index j = 0; j < 2; ++j)
        if (2 * r + i >= 2 * c + j) entries.emplace_back(2 * r + i, 2 * c + j, w * p[i] * q[j]);
  };
  for (const Strain& s : strains) {
    add(s.a, s.a, s.first, s.first, s.weight);
    add(s.b, s.b, s.second, s.second, s.weight);
    add(s.b, s.a, s.second, s.first, s.weight);  // a < b: the lower triangle
  }
  const auto size = static_cast<Eigen::Index>(2 * vertices);
  for (Eigen::Index i = 0; i < size; ++i) entries.emplace_back(i, i, vertex_weights[static_cast<std::size_t>(i / 2)]);
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
  std::vector<double> vertex_weights;
  const std::vector<double> weights = s.edge_weights(positions, vertex_weights);
  const std::vector<Strain> strains = s.strains(positions, v, weights);
  run.check();
  const Sparse matrix = s.matrix(strains, vertex_weights);
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
      const double pull = e.weight * e.of(t);
      residual.segment<2>(2 * e.a) -= pull * e.first;
      residual.segment<2>(2 * e.b) -= pull * e.second;
      const double most = e.weight * (std::abs(e.constant) + std::abs(e.first.dot(t.segment<2>(2 * e.a))));
      size.segment<2>(2 * e.a) += most * e.first.cwiseAbs();
      size.segment<2>(2 * e.b) += most * e.second.cwiseAbs();
    }
    // Nothing but rounding left: solving for it would only feed it into the directions that strain leaves open.
    if (residual.norm() <= kRounding * size.norm()) break;
    t += s.factor.solve(residual);
    good = t.allFinite();
  }
  double strain = 0;
  double total = 0;
  for (const Strain& e : strains) {
    strain += e.weight * e.of(t) * e.of(t);
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
