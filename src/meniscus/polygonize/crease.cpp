#include <meniscus/base/parallel.h>
#include <meniscus/polygonize/crease.h>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace meniscus::polygonize {
namespace {

using field::JetBatch;
using field::Order;
using field::PositionBatch;

constexpr std::size_t kBricksPerBlock = 64;
constexpr std::size_t kLoopsPerBlock = 64;
constexpr double kTurn = 0.94;     ///< cosine of 20°: normals of neighbours that disagree more are looked at
constexpr double kCrease = 0.985;  ///< cosine of 10°: branches that disagree less do not make a crease
constexpr double kNearest = 1e-5;  ///< how near to the vertex branches are evaluated at last, voxels
constexpr int kCrossingSteps = 8;  ///< the tangent plane makes up for what is left
constexpr int kNewtonSteps = 20;
constexpr int kLost = 5;      ///< how often branches may seem to be one
constexpr double kReach = 4;  ///< how far out of its cell a vertex may go, voxels

// Candidates ----------------------------------------------------------------------------------------------------------

/// A brick and its six neighbours.
class BrickSurroundings {
 public:
  BrickSurroundings(const Shell& shell, const SurfaceBrick& brick) : shell_(shell), brick_(brick) {
    for (std::size_t f = 0; f < 6; ++f) {
      Coord index = brick.index;
      index[f / 2] += f % 2 == 0 ? -1 : 1;
      across_[f] = shell.find(index);
    }
  }

  /// Whether a vertex of the cell across some face has quite another normal than vertex v of this cell.
  bool turns(const Vec3& normal, const Coord& cell) const {
    for (std::size_t f = 0; f < 6; ++f) {
      Coord c = cell;
      c[f / 2] += f % 2 == 0 ? -1 : 1;
      const SurfaceBrick* brick = c[f / 2] < 0 || c[f / 2] >= kBrickCells ? across_[f] : &brick_;
      c[f / 2] &= kBrickCells - 1;
      if (brick == nullptr || !brick->has(c[0], c[1], c[2])) continue;
      const SurfaceCell& other = shell_.cells[brick->cell(c[0], c[1], c[2])];
      const Vec3* n = shell_.normals.data() + brick->first_vertex + other.first_vertex;
      for (int count = CellCases::get()[other.kind].vertices(); count > 0; --count, ++n)
        if (n->dot(normal) < kTurn && !n->isZero(0)) return true;
    }
    return false;
  }

 private:
  const Shell& shell_;
  const SurfaceBrick& brick_;
  std::array<const SurfaceBrick*, 6> across_{};
};

void append_candidates(const Shell& shell, const SurfaceBrick& brick, std::vector<std::size_t>& candidates) {
  const BrickSurroundings around(shell, brick);
  const SurfaceCell* cell = shell.cells.data() + brick.first_cell;
  for (int i = 0; i < kBrickCells; ++i)
    for (std::uint64_t word = brick.mask[static_cast<std::size_t>(i)]; word != 0; word &= word - 1, ++cell) {
      const int bit = __builtin_ctzll(word);
      for (int n = 0; n < CellCases::get()[cell->kind].vertices(); ++n) {
        const std::size_t v = std::size_t{brick.first_vertex} + cell->first_vertex + static_cast<std::size_t>(n);
        const Vec3& normal = shell.normals[v];
        if (!normal.isZero(0) && (shell.placed[v] == Placed::Bisected || around.turns(normal, {i, bit / 8, bit % 8})))
          candidates.push_back(v);
      }
    }
}

/// Vertices of loops next to which the normal turns sharply, rising.
std::vector<std::size_t> find_candidates(const Shell& shell, const RunControl& run) {
  return parallel_reduce(
      shell.bricks.size(), kBricksPerBlock, run, std::vector<std::size_t>{},
      [&](std::size_t begin, std::size_t end) {
        std::vector<std::size_t> found;
        for (std::size_t b = begin; b < end; ++b) append_candidates(shell, shell.bricks[b], found);
        return found;
      },
      [](std::vector<std::size_t> a, const std::vector<std::size_t>& b) {
        a.insert(a.end(), b.begin(), b.end());
        return a;
      });
}

// Placement -----------------------------------------------------------------------------------------------------------

/// A tangent plane of the level set through a point, moved to F = 0: n·x = n·point − distance.
struct Plane {
  Vec3 point;
  Vec3 normal;
  double distance;
};

/// Where planes meet, and the direction of the crease if they leave just one open (else zero).
struct Meeting {
  Vec3 point;
  Vec3 open;
};

/// The point that minimises the squared distances to the planes, as near to `from` as they leave open. Directions in which
/// the planes determine little (eigenvalues below `truncation`, of the largest) count as open.
Meeting meet(const Plane* planes, std::size_t count, const Vec3& from, double truncation) {
  Mat3 a = Mat3::Zero();
  Vec3 b = Vec3::Zero();
  for (std::size_t n = 0; n < count; ++n) {
    const Plane& p = planes[n];
    a += p.normal * p.normal.transpose();
    b -= (p.normal.dot(from - p.point) + p.distance) * p.normal;
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(a);
  Vec3 step = Vec3::Zero();
  for (int e = 2; e >= 0; --e) {
    const double value = eigen.eigenvalues()[e];
    const auto direction = eigen.eigenvectors().col(e);
    if (!(value > truncation * eigen.eigenvalues()[2])) return {from + step, e == 0 ? Vec3(direction) : Vec3(Vec3::Zero())};
    step += direction.dot(b) / value * direction;
  }
  return {from + step, Vec3::Zero()};
}

/// Slides p along `open` into the cube from `low` on, if it goes through it.
Vec3 slid_into(const Vec3& p, const Vec3& open, const Vec3& low, double edge) {
  double first = -std::numeric_limits<double>::infinity();
  double last = -first;
  for (int a = 0; a < 3; ++a) {
    const double s = (low[a] - p[a]) / open[a];
    const double t = (low[a] + edge - p[a]) / open[a];
    first = std::max(first, std::min(s, t));
    last = std::min(last, std::max(s, t));
  }
  return first <= last ? Vec3(p + std::clamp(0.0, first, last) * open) : p;
}

/// Whether the normals disagree enough for a crease.
bool creased(const Plane* planes, std::size_t count) {
  for (std::size_t n = 1; n < count; ++n)
    for (std::size_t m = 0; m < n; ++m)
      if (planes[n].normal.dot(planes[m].normal) < kCrease) return true;
  return false;
}

/// A loop on its way to the crease.
struct Loop {
  std::size_t vertex = 0;
  Coord cell{};
  std::size_t first = 0;  ///< its crossings
  std::size_t count = 0;
  Vec3 position = Vec3::Zero();
  double nearness = std::numeric_limits<double>::infinity();  ///< of its branches' samples to the vertex, voxels
  int lost = 0;                                               ///< how often the branches could not be told apart
  bool corner = false;                                        ///< its planes meet in a point
  double slope = 0;                                           ///< largest |∇F| of the branches
};

/// The candidates of one block.
class CreaseFinder {
 public:
  CreaseFinder(const ClippedField& field, Shell& shell, double tolerance)
      : field_(field), shell_(shell), wanted_(tolerance) {}

  ProjectReport run(std::span<const std::size_t> vertices) {
    find_crossings(vertices);
    start();
    for (int step = 0; step < kNewtonSteps && !loops_.empty(); ++step) newton();
    accept();
    return report_;
  }

 private:
  double tolerance(const Vec3& p) const { return surface_tolerance(shell_.lattice, wanted_, p); }

  /// Bisects the crossed lattice edges of every loop. The vertex where it is counts as one more: it may have been drawn to
  /// a branch that crosses no lattice edge.
  void find_crossings(std::span<const std::size_t> vertices) {
    std::vector<Vec3> inside;
    std::vector<Vec3> outside;
    for (const std::size_t v : vertices) {
      const VertexPlace place = place_of(shell_, v);
      Loop loop;
      loop.vertex = v;
      loop.cell = place.cell;
      loop.count = place.corners.size() / 2;
      for (std::size_t c = 0; c < place.corners.size(); ++c)
        (place.inside[c] ? inside : outside).push_back(shell_.lattice.point(place.corners[c]));
      loops_.push_back(loop);
    }
    PositionBatch at(inside.size());
    JetBatch jets(inside.size(), Order::Value);
    for (int step = 0; step < kCrossingSteps; ++step) {
      for (std::size_t n = 0; n < inside.size(); ++n) at.set(n, 0.5 * (inside[n] + outside[n]));
      field_.evaluate(at.view(), jets.view());
      for (std::size_t n = 0; n < inside.size(); ++n) (jets.value(n) < 0 ? inside : outside)[n] = at.view()[n];
    }
    report_.evaluations += kCrossingSteps * inside.size();
    std::size_t edge = 0;
    for (Loop& loop : loops_) {
      loop.first = crossings_.size();
      for (std::size_t n = 0; n < loop.count; ++n, ++edge) crossings_.push_back(0.5 * (inside[edge] + outside[edge]));
      crossings_.push_back(shell_.positions[loop.vertex]);
      ++loop.count;
    }
  }

  /// On the way from the loop's vertex to a crossing.
  Vec3 sample(const Loop& loop, const Vec3& crossing) const {
    const Vec3 way = crossing - loop.position;
    const double share = loop.nearness * shell_.lattice.voxel / way.norm();
    return share < 1 ? Vec3(loop.position + share * way) : crossing;
  }

  /// The branches' planes of every loop, one loop after the other; drops loops where some branch has none.
  std::vector<Plane> branches() {
    std::vector<Vec3> points;
    for (const Loop& loop : loops_)
      for (std::size_t n = 0; n < loop.count; ++n) points.push_back(sample(loop, crossings_[loop.first + n]));
    JetBatch jets(points.size(), Order::Gradient);
    field_.evaluate(PositionBatch(points).view(), jets.view());
    report_.evaluations += points.size();
    std::vector<Plane> planes;
    std::size_t at = 0;
    keep_loops([&](Loop& loop) {
      const std::size_t begin = planes.size();
      loop.slope = 0;
      for (const std::size_t end = at + loop.count; at < end; ++at) {
        const double slope = jets.gradient(at).norm();
        const Plane plane{points[at], jets.gradient(at) / slope, jets.value(at) / slope};
        if (plane.normal.allFinite() && std::isfinite(plane.distance)) planes.push_back(plane);
        loop.slope = std::max(loop.slope, slope);
      }
      const bool all = planes.size() - begin == loop.count;
      if (!all) planes.resize(begin);
      return all;
    });
    return planes;
  }

  template <class Keep>
  void keep_loops(const Keep& keep) {
    std::size_t kept = 0;
    for (Loop& loop : loops_)
      if (keep(loop)) loops_[kept++] = loop;
    loops_.resize(kept);
  }

  Meeting met(const Loop& loop, const Plane* planes, const Vec3& from, double truncation) const {
    Meeting meeting = meet(planes, loop.count, from, truncation);
    const Vec3 low = shell_.lattice.point(loop.cell);
    if (!meeting.open.isZero(0)) meeting.point = slid_into(meeting.point, meeting.open, low, shell_.lattice.voxel);
    return meeting;
  }

  /// First guess: where the planes at the crossings meet, within the cell. Drops loops without a crease.
  void start() {
    const std::vector<Plane> planes = branches();
    const double voxel = shell_.lattice.voxel;
    const Plane* plane = planes.data();
    keep_loops([&](Loop& loop) {
      const Plane* own = std::exchange(plane, plane + loop.count);
      if (!creased(own, loop.count)) return false;
      Vec3 mean = Vec3::Zero();
      for (std::size_t n = 0; n < loop.count; ++n) mean += crossings_[loop.first + n];
      mean /= static_cast<double>(loop.count);
      const Vec3 reach = Vec3::Constant(kReach * voxel);
      const Vec3 low = shell_.lattice.point(loop.cell);
      loop.position = met(loop, own, mean, 0.02).point.cwiseMax(low - reach).cwiseMin(low + Vec3::Constant(voxel) + reach);
      loop.nearness = 0.25;
      return true;
    });
  }

  /// One step for every loop; those that have arrived are put aside, those that cannot are dropped.
  void newton() {
    const std::vector<Plane> planes = branches();
    const Plane* plane = planes.data();
    keep_loops([&](Loop& loop) {
      const Plane* own = std::exchange(plane, plane + loop.count);
      if (!creased(own, loop.count)) {
        // Too near for how far the vertex still is from the crease, or no crease.
        loop.nearness = std::min(1.0, 4 * loop.nearness);
        return ++loop.lost <= kLost;
      }
      const Meeting meeting = met(loop, own, loop.position, 0.005);
      const Vec3 next = meeting.point;
      loop.corner = meeting.open.isZero(0);
      const double moved = (next - loop.position).norm();
      loop.position = next;
      if (!(moved < 2 * shell_.lattice.voxel)) return false;
      if (loop.nearness <= kNearest && moved <= tolerance(next)) {
        arrived_.push_back(loop);
        return false;
      }
      loop.nearness = std::clamp(16 * moved / shell_.lattice.voxel, kNearest, std::max(kNearest, 0.25 * loop.nearness));
      return true;
    });
  }

  /// Whether the crease is no farther from the loop's cell than a loop can be that sees both its sides.
  bool allowed(const Loop& loop) const {
    const Vec3 in_cell = (loop.position - shell_.lattice.point(loop.cell)) / shell_.lattice.voxel;
    return in_cell.minCoeff() > -kReach && in_cell.maxCoeff() < 1 + kReach;
  }

  void accept() {
    std::vector<Vec3> points;
    for (const Loop& loop : arrived_) points.push_back(loop.position);
    JetBatch jets(points.size(), Order::Value);
    field_.evaluate(PositionBatch(points).view(), jets.view());
    report_.evaluations += points.size();
    for (std::size_t n = 0; n < arrived_.size(); ++n) {
      const Loop& loop = arrived_[n];
      const double residual = std::abs(jets.value(n)) / loop.slope;
      if (residual <= tolerance(loop.position) && allowed(loop)) move(loop, residual);
    }
  }

  void move(const Loop& loop, double residual) {
    Vec3& p = shell_.positions[loop.vertex];
    const auto at_box = [&] { return field_.past_box(p) >= -tolerance(p) ? 1 : 0; };
    report_.at_box -= at_box();
    p = loop.position;
    report_.at_box += at_box();
    if (shell_.placed[loop.vertex] == Placed::Bisected) --report_.bisected;
    ++report_.creases;
    report_.worst_residual = std::max(report_.worst_residual, residual / shell_.lattice.voxel);
    shell_.placed[loop.vertex] = loop.corner ? Placed::Corner : Placed::Crease;
    shell_.normals[loop.vertex] = Vec3::Zero();
  }

  const ClippedField& field_;
  Shell& shell_;
  double wanted_;
  std::vector<Vec3> crossings_;
  std::vector<Loop> loops_;
  std::vector<Loop> arrived_;
  ProjectReport report_;
};

}  // namespace

void place_on_creases(const ClippedField& field, Shell& shell, double tolerance, ProjectReport& report,
                      const RunControl& run) {
  const std::vector<std::size_t> candidates = find_candidates(shell, run);
  report = parallel_reduce(
      candidates.size(), kLoopsPerBlock, run, report,
      [&](std::size_t begin, std::size_t end) {
        return CreaseFinder(field, shell, tolerance).run({candidates.data() + begin, end - begin});
      },
      sum);
}

}  // namespace meniscus::polygonize
