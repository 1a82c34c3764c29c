#include <meniscus/base/error.h>
#include <meniscus/motion/isometric.h>
#include <meniscus/motion/rigid_parts.h>
#include <meniscus/motion/strain_factor.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace meniscus::motion {
namespace {

constexpr double kGuide = 1e-5;      // what the preconditioner adds, relative to strain
constexpr double kConverged = 1e-3;  // residual, of that which the rigid motions leave
constexpr int kPatience = 12;        // iterations; more are needed: the factorisation is of another shape
constexpr int kMost = 60;            // with a factorisation of this one
constexpr double kSlideBound = 2;    // times what is left of the guide and of the normal speeds beside the rigid motions

using Vector = Strain::Vector;

/// What the velocities t are pulled by.
Vector downhill(const std::vector<Strain>& strains, const Vector& t) {
  Vector force = Vector::Zero(t.size());
  for (const Strain& e : strains) e.scatter(-e.weight * (e.rows.transpose() * e.of(t)), force);
  return force;
}

/// Lowers the strain of t by preconditioned conjugate gradients. False if `most` iterations do not do.
bool descend(const std::vector<Strain>& strains, const StrainFactor& factor, int most, Vector& t) {
  const double enough = kConverged * downhill(strains, Vector::Zero(t.size())).norm();
  Vector residual = downhill(strains, t);
  Vector direction = Vector::Zero(t.size());
  Vector image(t.size());
  double before = 0;
  for (int k = 0; residual.norm() > enough; ++k) {
    if (k == most) return false;
    const Vector step = factor.solve(residual);
    const double energy = residual.dot(step);
    if (!(energy > 0)) return false;
    direction = step + (k == 0 ? 0 : energy / before) * direction;
    before = energy;
    image.setZero();
    for (const Strain& e : strains) e.scatter(e.weight * (e.rows.transpose() * (e.rows * e.gather(direction))), image);
    const double length = energy / direction.dot(image);
    t += length * direction;
    residual -= length * image;
  }
  return t.allFinite();
}

/// Root mean square by area.
double mean_strain(const std::vector<Strain>& strains, const Vector& t) {
  double sum = 0;
  double total = 0;
  for (const Strain& e : strains) {
    sum += e.weight * e.of(t).squaredNorm();
    total += e.weight;
  }
  return total > 0 ? std::sqrt(sum / total) : 0;
}

/// A few triangles that hang on to the rest by a corner can be flung about: no slide is much faster than what asks for it.
double fastest_slide(const RigidParts& parts, const Velocities& v) {
  double most = 0;
  for (std::size_t i = 0; i < v.velocity.size(); ++i) {
    if (v.singular[i] != 0) continue;
    most = std::max({most, std::abs(parts.excess()[i]), (v.velocity[i] - parts.velocity()[i]).norm()});
  }
  return kSlideBound * most;
}

}  // namespace

struct IsometricSolver::State {
  std::vector<Triangle> triangles;
  std::size_t vertices = 0;
  std::vector<std::int32_t> neighbour;  // of each vertex one; itself if it has none
  Memory memory;
  StrainFactor factor;
  bool analysed = false;

  bool factorise();
  bool least_strain(const std::vector<Strain>& strains, std::span<const Vec3> positions, const std::vector<Vec3>& normals,
                    Vector& t, const RunControl& run);
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

const IsometricSolver::Memory& IsometricSolver::memory() const { return state_->memory; }

void IsometricSolver::recall(Memory memory) {
  const std::size_t n = state_->vertices;
  if (memory.positions.size() != n || memory.normals.size() != n || memory.tangential.size() != 2 * n)
    throw InvalidInput("what is remembered is of another mesh");
  state_->memory = std::move(memory);
  state_->factorise();
}

bool IsometricSolver::State::factorise() {
  if (!analysed) factor.analyse(triangles, vertices);
  analysed = true;
  const std::vector<Vec3>& x = memory.positions;
  const std::vector<Vec3>& n = memory.normals;
  return factor.factorise(strains(resisting(x, n, triangles), x, n, {}, tangent_frames(x, n, neighbour), {}), kGuide);
}

/// From the last solution on, with the factorisation at hand if that does.
bool IsometricSolver::State::least_strain(const std::vector<Strain>& strains, std::span<const Vec3> positions,
                                          const std::vector<Vec3>& normals, Vector& t, const RunControl& run) {
  if (factor.ready()) {
    t = Eigen::Map<const Vector>(memory.tangential.data(), t.size());
    if (descend(strains, factor, kPatience, t)) return true;
  }
  memory.positions.assign(positions.begin(), positions.end());
  memory.normals = normals;
  const bool made = factorise();
  run.check();
  return made && descend(strains, factor, kMost, t);
}

double IsometricSolver::solve(std::span<const Vec3> positions, Velocities& v, const RunControl& run) {
  State& s = *state_;
  if (positions.size() != s.vertices || v.velocity.size() != s.vertices)
    throw InvalidInput("the velocities are not those of the mesh");
  if (s.vertices == 0) return 0;
  const Resisting mesh = resisting(positions, v.normal, s.triangles);
  const RigidParts parts(positions, mesh.triangles, mesh.area, v);
  std::vector<Vec3> slide(s.vertices, Vec3::Zero());  // beyond the parts' motions
  double strain = 0;
  bool good = true;
  if (!parts.all_rigid()) {
    const TangentFrames frames = tangent_frames(positions, v.normal, s.neighbour);
    const std::vector<Strain> list = strains(mesh, positions, v.normal, parts.excess(), frames, run);
    Vector t = Vector::Zero(static_cast<Eigen::Index>(2 * s.vertices));
    good = s.least_strain(list, positions, v.normal, t, run);
    if (!good) t.setZero();
    for (std::size_t i = 0; i < s.vertices; ++i) {
      const auto k = static_cast<Eigen::Index>(2 * i);
      slide[i] = t[k] * frames.first[i] + t[k + 1] * frames.second[i];
    }
    parts.remove_untold(slide);
    s.memory.tangential.clear();
    for (std::size_t i = 0; i < s.vertices; ++i) {
      s.memory.tangential.push_back(frames.first[i].dot(slide[i]));
      s.memory.tangential.push_back(frames.second[i].dot(slide[i]));
    }
    strain = mean_strain(list, t);
    const double most = fastest_slide(parts, v);
    for (std::size_t i = 0; i < s.vertices; ++i) {
      const double speed = slide[i].norm();
      if (!(speed > most)) continue;
      slide[i] *= most / speed;
      v.confidence[i] *= most / speed;
    }
  }
  for (std::size_t i = 0; i < s.vertices; ++i) {
    if (!good) v.confidence[i] = 0;
    if (good && v.singular[i] == 0) v.velocity[i] = parts.velocity()[i] + parts.excess()[i] * v.normal[i] + slide[i];
  }
  return good ? strain : 0;
}

}  // namespace meniscus::motion
