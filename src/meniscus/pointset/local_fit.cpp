#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>
#include <meniscus/field/cpu.h>
#include <meniscus/pointset/bspline.h>
#include <meniscus/pointset/local_fit.h>
#include <meniscus/pointset/local_fit.kernel.h>
#include <meniscus/pointset/neighbourhood.h>

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>

namespace meniscus::pointset {
namespace {

constexpr double kReach = 1.1;   // of a domain, over the distance to the farthest neighbour: that one keeps some weight
constexpr double kOffset = 0.3;  // of off-surface points at most, over the same distance
constexpr double kOffsetWeight = 0.1;  // of their rows: they tell the slope, the points themselves where the surface is
constexpr double kRidge = 1e-9;        // keeps linear functions, which do not bend, from floating where no data speak
constexpr std::size_t kBlock = 256;    // a multiple of the kernel's lanes

/// Weight of gradient rows against value rows, in local coordinates: more withstands noise, less bends more freely.
double gradient_weight(FitOptions::Rows rows) {
  using Rows = FitOptions::Rows;
  return rows == Rows::Offset ? 0 : rows == Rows::Both ? 0.1 : 1;
}

void check(const FitOptions& o) {
  if (o.neighbours < 1) throw InvalidInput("fit: at least one neighbour is needed");
  if (o.grid < 3 || o.grid > kMostGrid)
    throw InvalidInput("fit: the grid must have 3 to " + std::to_string(kMostGrid) + " control points along an axis, not " +
                       std::to_string(o.grid));
  if (!(o.smoothing >= 0) || !std::isfinite(o.smoothing)) throw InvalidInput("fit: smoothing must not be negative");
  if (!(o.outlier_ratio >= 0)) throw InvalidInput("fit: the outlier ratio must not be negative");
}

// ---- Which points take part ----

/// The sound points of the cloud, in its order.
std::vector<std::size_t> sound_points(const points::Cloud& cloud, std::span<const double> normals, FitReport& report) {
  const auto& p = cloud.positions;
  std::vector<std::size_t> kept;
  kept.reserve(p.size());
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Vec3 n(normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]);
    const double length = n.stableNorm();
    if (!p[i].allFinite())
      ++report.not_finite;
    else if (!(length > 0) || !std::isfinite(length))
      ++report.without_normal;
    else
      kept.push_back(i);
  }
  // Of coincident points the first stays.
  std::vector<std::size_t> sorted = kept;
  std::sort(sorted.begin(), sorted.end(), [&](std::size_t a, std::size_t b) {
    const auto before = std::lexicographical_compare_three_way(p[a].data(), p[a].data() + 3, p[b].data(), p[b].data() + 3);
    return before != 0 ? before < 0 : a < b;
  });
  std::vector<bool> twin(p.size(), false);
  for (std::size_t k = 1; k < sorted.size(); ++k) twin[sorted[k]] = p[sorted[k]] == p[sorted[k - 1]];
  std::erase_if(kept, [&](std::size_t i) { return twin[i]; });
  report.coincident = sorted.size() - kept.size();
  return kept;
}

PointSet bare_set(const points::Cloud& cloud, std::span<const double> normals, std::span<const std::size_t> kept, int grid) {
  PointSet set;
  set.grid = grid;
  set.resize(kept.size());
  for (std::size_t k = 0; k < kept.size(); ++k) {
    const std::size_t i = kept[k];
    set.set_position(k, cloud.positions[i]);
    set.set_normal(k, Vec3(normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]).stableNormalized());
  }
  if (kept.size() == cloud.size())
    set.attributes = cloud.attributes;
  else
    set.attributes = cloud.attributes.gathered(kept);
  set.attributes.erase(attribute::kNormal);
  return set;
}

// ---- Neighbourhoods ----

/// The neighbours of some points of a set, and what follows from them.
struct Neighbourhoods {
  std::size_t count = 0;             // neighbours of each
  std::vector<std::uint32_t> index;  // those of member m begin at m · count, nearest first
  std::vector<double> radius;        // distance to the farthest, by member
  std::vector<SafeOffsets> offsets;  // by member
  std::vector<std::uint32_t> slot;   // which member a point of the set is; empty when all are, in order

  std::span<const std::uint32_t> of(std::size_t m) const { return {index.data() + m * count, count}; }
  std::size_t member(std::size_t i) const { return slot.empty() ? i : slot[i]; }
};

void find_neighbours(const PointSet& set, std::span<const std::size_t> members, const points::NeighbourSearch& search,
                     std::size_t wanted, Neighbourhoods& hoods, const RunControl& run) {
  hoods.count = std::min(wanted, set.size() - 1);
  hoods.index.resize(members.size() * hoods.count);
  hoods.radius.resize(members.size());
  parallel_blocks(members.size(), kBlock, run, [&](std::size_t begin, std::size_t end) {
    std::vector<points::Neighbour> found;
    for (std::size_t m = begin; m < end; ++m) {
      search.nearest(set.position(members[m]), hoods.count + 1, found);
      std::size_t k = 0;
      for (const points::Neighbour& n : found)
        if (n.index != members[m] && k < hoods.count) {
          hoods.index[m * hoods.count + k++] = n.index;
          hoods.radius[m] = std::sqrt(n.squared_distance);
        }
    }
  });
}

void find_offsets(const PointSet& set, std::span<const std::size_t> members, Neighbourhoods& hoods, const RunControl& run) {
  hoods.offsets.resize(members.size());
  parallel_for(members.size(), kBlock, run, [&](std::size_t m) {
    hoods.offsets[m] = safe_offsets(set, members[m], hoods.of(m), kOffset * hoods.radius[m]);
  });
}

/// Points that stand off: their neighbours are much farther than those of the points near them.
std::vector<bool> stand_off(const Neighbourhoods& hoods, double ratio, const RunControl& run) {
  std::vector<std::uint8_t> off(hoods.radius.size());
  parallel_blocks(off.size(), kBlock, run, [&](std::size_t begin, std::size_t end) {
    std::vector<double> radii;
    for (std::size_t i = begin; i < end; ++i) {
      radii.clear();
      for (const std::uint32_t j : hoods.of(i)) radii.push_back(hoods.radius[j]);
      const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
      std::nth_element(radii.begin(), middle, radii.end());
      off[i] = hoods.radius[i] > ratio * *middle ? 1 : 0;
    }
  });
  return {off.begin(), off.end()};
}

// ---- The least-squares problems ----

/// One row: place, value and gradient that the spline should have there beyond the tangent plane; local coordinates.
struct Target {
  Vec3 place = Vec3::Zero();
  double weight = 0, value = 0;
  Vec3 gradient = Vec3::Zero();
};

/// Calls visit(Target) for the rows of member m. All members have the same number of rows.
template <class Visit>
void for_rows(const PointSet& set, std::span<const std::size_t> members, std::size_t m, const Neighbourhoods& hoods,
              FitOptions::Rows rows, const Visit& visit) {
  const std::size_t i = members[m];
  const Vec3 p = set.position(i);
  const Frame frame = frame_about(set.normal(i));
  const double unit = 1 / (kReach * hoods.radius[m]);
  const auto local = [&](const Vec3& d) {
    return Vec3(unit * d.dot(frame.u), unit * d.dot(frame.v), unit * d.dot(frame.w));
  };
  const auto around = [&](std::size_t j) {
    const Vec3 d = set.position(j) - p, n = set.normal(j);
    const double t2 = d.squaredNorm() * unit * unit, left = (1 - t2) * (1 - t2), theta = left * left;
    const Vec3 place = local(d), direction(n.dot(frame.u), n.dot(frame.v), n.dot(frame.w));
    visit(Target{place, theta, -place.z(), direction - Vec3::UnitZ()});
    if (rows == FitOptions::Rows::Gradient) return;
    const SafeOffsets offset = hoods.offsets[hoods.member(j)];
    for (const double h : {offset.outer * unit, -offset.inner * unit}) {
      const Vec3 q = place + h * direction;
      visit(Target{q, kOffsetWeight * theta, h - q.z(), direction - Vec3::UnitZ()});
    }
  };
  around(i);
  for (const std::uint32_t j : hoods.of(m)) around(j);
}

std::size_t row_count(const Neighbourhoods& hoods, FitOptions::Rows rows) {
  return (hoods.count + 1) * (rows == FitOptions::Rows::Gradient ? 1 : 3);
}

/// What bending and size of a tensor-product function cost, from the products of its basis functions along one axis and of
/// their first and second derivatives, all integrated over [−1, 1].
Eigen::MatrixXd regular_matrix(const std::array<Eigen::MatrixXd, 3>& gram, double smoothing) {
  const Eigen::Index g = gram[0].rows(), n = g * g * g;
  Eigen::MatrixXd r(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) {
      const auto term = [&](std::size_t a, std::size_t b, std::size_t c) {
        return gram[a](i / (g * g), j / (g * g)) * gram[b](i / g % g, j / g % g) * gram[c](i % g, j % g);
      };
      const double bending =
          term(2, 0, 0) + term(0, 2, 0) + term(0, 0, 2) + 2 * (term(1, 1, 0) + term(1, 0, 1) + term(0, 1, 1));
      r(i, j) = (smoothing * bending + kRidge * term(0, 0, 0)) / 8;
    }
  return r;
}

std::array<Eigen::MatrixXd, 3> gram_of_monomials() {
  std::array<Eigen::MatrixXd, 3> gram;
  gram[0] = Eigen::Matrix3d{{2, 0, 2.0 / 3}, {0, 2.0 / 3, 0}, {2.0 / 3, 0, 2.0 / 5}};
  gram[1] = Eigen::Matrix3d{{0, 0, 0}, {0, 2, 0}, {0, 0, 8.0 / 3}};
  gram[2] = Eigen::Matrix3d{{0, 0, 0}, {0, 0, 0}, {0, 0, 8}};
  return gram;
}

std::array<Eigen::MatrixXd, 3> gram_of_splines(int grid) {
  std::array<Eigen::MatrixXd, 3> gram;
  gram.fill(Eigen::MatrixXd::Zero(grid, grid));
  const double half = 1.0 / (grid - 2);  // of a span, on [−1, 1]; derivatives by the span are this times two larger
  const double gauss[3][2] = {{-std::sqrt(0.6), 5.0 / 9}, {0, 8.0 / 9}, {std::sqrt(0.6), 5.0 / 9}};
  for (int span = 0; span < grid - 2; ++span)
    for (const auto& [place, weight] : gauss) {
      std::array<std::array<double, kMostGrid>, 3> n;
      bspline::jets(grid, -1 + half * (2 * span + 1 + place), n[0].data(), n[1].data(), n[2].data());
      for (std::size_t order = 0; order < 3; ++order)
        for (int a = 0; a < grid; ++a)
          for (int b = 0; b < grid; ++b)
            gram[order](a, b) += weight * half * std::pow(2 * half, -2.0 * static_cast<double>(order)) *
                                 n[order][static_cast<std::size_t>(a)] * n[order][static_cast<std::size_t>(b)];
    }
  return gram;
}

void add_plane(PointSet& set, std::size_t i) {
  const auto coefficients = set.coefficients_of(i);
  for (std::size_t k = 0; k < coefficients.size(); ++k)
    coefficients[k] = set.reach[i] * (coefficients[k] + bspline::greville(set.grid, static_cast<int>(k) % set.grid));
}

/// B-spline coefficients of c₀ + c₁ u + c₂ u², axis by axis, in place.
void from_monomials(double* c) {
  for (const std::size_t stride : {9u, 3u, 1u})
    for (std::size_t line = 0; line < 9; ++line) {
      double* p = c + (stride == 9 ? line : stride == 3 ? line / 3 * 9 + line % 3 : line * 3);
      const double c0 = p[0], c1 = p[stride], c2 = p[2 * stride];
      p[0] = c0 - 2 * c1 + 3 * c2, p[stride] = c0 - c2, p[2 * stride] = c0 + 2 * c1 + 3 * c2;
    }
}

/// Grids of 3³: four points at a time.
class SmallGrids {
 public:
  explicit SmallGrids(const FitOptions& o) : rows_(o.rows), gradient_(gradient_weight(o.rows)) {
    const Eigen::MatrixXd r = regular_matrix(gram_of_monomials(), o.smoothing);
    for (Eigen::Index i = 0; i < r.rows(); ++i)
      for (Eigen::Index j = 0; j <= i; ++j) regular_[static_cast<std::size_t>(i * (i + 1) / 2 + j)] = r(i, j);
  }

  void operator()(PointSet& set, std::span<const std::size_t> members, std::size_t begin, std::size_t end,
                  const Neighbourhoods& hoods) const {
    using namespace fit_kernel;
    const std::size_t count = row_count(hoods, rows_);
    std::vector<Row> rows(count);
    double solution[kUnknowns][kLanes];
    for (std::size_t first = begin; first < end; first += kLanes) {
      const std::size_t used = std::min(kLanes, end - first);
      for (std::size_t l = 0; l < kLanes; ++l) {
        std::size_t r = 0;  // a short last group repeats its first member
        for_rows(set, members, first + (l < used ? l : 0), hoods, rows_, [&](const Target& t) { put(t, rows[r++], l); });
      }
      (field::has_avx2() ? solve_avx2 : solve)(rows.data(), count, gradient_, regular_.data(), solution);
      for (std::size_t l = 0; l < used; ++l) {
        const std::size_t i = members[first + l];
        const auto c = set.coefficients_of(i);
        for (std::size_t k = 0; k < kUnknowns; ++k) c[k] = solution[k][l];
        from_monomials(c.data());
        add_plane(set, i);
      }
    }
  }

 private:
  static void put(const Target& t, fit_kernel::Row& row, std::size_t l) {
    row.u[l] = t.place.x(), row.v[l] = t.place.y(), row.w[l] = t.place.z();
    row.weight[l] = t.weight, row.target[l] = t.value;
    row.gu[l] = t.gradient.x(), row.gv[l] = t.gradient.y(), row.gw[l] = t.gradient.z();
  }

  FitOptions::Rows rows_;
  double gradient_;
  std::array<double, fit_kernel::kPacked> regular_;
};

/// Grids of any size: one point at a time.
class LargeGrids {
 public:
  explicit LargeGrids(const FitOptions& o)
      : grid_(o.grid), rows_(o.rows), regular_(regular_matrix(gram_of_splines(o.grid), o.smoothing)) {}

  void operator()(PointSet& set, std::span<const std::size_t> members, std::size_t begin, std::size_t end,
                  const Neighbourhoods& hoods) const {
    const Eigen::Index n = regular_.rows();
    for (std::size_t m = begin; m < end; ++m) {
      Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n, n);
      Eigen::VectorXd rhs = Eigen::VectorXd::Zero(n);
      double weights = 0;
      for_rows(set, members, m, hoods, rows_, [&](const Target& t) {
        add(t, matrix, rhs);
        weights += t.weight;
      });
      matrix = matrix / weights + regular_;
      const Eigen::VectorXd solution = matrix.selfadjointView<Eigen::Lower>().ldlt().solve(rhs / weights);
      const std::size_t i = members[m];
      const auto c = set.coefficients_of(i);
      for (std::size_t k = 0; k < c.size(); ++k) c[k] = solution[static_cast<Eigen::Index>(k)];
      add_plane(set, i);
    }
  }

 private:
  void add(const Target& t, Eigen::MatrixXd& matrix, Eigen::VectorXd& rhs) const {
    double n[3][3][kMostGrid];  // axis, order, basis function
    for (int axis = 0; axis < 3; ++axis)
      bspline::jets(grid_, std::clamp(t.place[axis], -1.0, 1.0), n[axis][0], n[axis][1], n[axis][2]);
    const auto rank_one = [&](int du, int dv, int dw, double weight, double value) {
      Eigen::VectorXd basis(rhs.size());
      Eigen::Index k = 0;
      for (int a = 0; a < grid_; ++a)
        for (int b = 0; b < grid_; ++b)
          for (int c = 0; c < grid_; ++c) basis[k++] = n[0][du][a] * n[1][dv][b] * n[2][dw][c];
      matrix.selfadjointView<Eigen::Lower>().rankUpdate(basis, weight);
      rhs += weight * value * basis;
    };
    rank_one(0, 0, 0, t.weight, t.value);
    if (rows_ == FitOptions::Rows::Offset) return;
    const double slope = 0.5 * (grid_ - 2), weight = gradient_weight(rows_) * t.weight * slope * slope;  // d(span)/du
    rank_one(1, 0, 0, weight, t.gradient.x() / slope);
    rank_one(0, 1, 0, weight, t.gradient.y() / slope);
    rank_one(0, 0, 1, weight, t.gradient.z() / slope);
  }

  int grid_;
  FitOptions::Rows rows_;
  Eigen::MatrixXd regular_;
};

/// Reach, border and coefficients of members [0, count).
void solve(PointSet& set, std::span<const std::size_t> members, std::size_t count, const Neighbourhoods& hoods,
           const FitOptions& options, const RunControl& run) {
  const auto fit_all = [&](const auto& fitter) {
    parallel_blocks(count, kBlock, run, [&](std::size_t begin, std::size_t end) {
      for (std::size_t m = begin; m < end; ++m) {
        set.reach[members[m]] = kReach * hoods.radius[m];
        set.set_border(members[m], border_at(set, members[m], hoods.of(m)));
      }
      fitter(set, members, begin, end, hoods);
    });
  };
  if (options.grid == 3)
    fit_all(SmallGrids(options));
  else
    fit_all(LargeGrids(options));
}

std::vector<std::size_t> all_of(const PointSet& set) {
  std::vector<std::size_t> all(set.size());
  std::iota(all.begin(), all.end(), 0);
  return all;
}

void require_two(const PointSet& set) {
  if (set.size() < 2)
    throw InvalidInput("fit: " + std::to_string(set.size()) + " usable points are too few: two distinct ones are needed");
}

}  // namespace

std::vector<Vec3> positions(const PointSet& set) {
  std::vector<Vec3> p(set.size());
  for (std::size_t i = 0; i < p.size(); ++i) p[i] = set.position(i);
  return p;
}

PointSet fit(const points::Cloud& cloud, const FitOptions& options, FitReport* report, RunControl run) {
  check(options);
  const auto normals = cloud.attributes.values(attribute::kNormal, 3);
  if (normals.size() != 3 * cloud.size()) throw InvalidInput("fit: the points have no normals (attribute N)");
  FitReport counts{.points = cloud.size()};
  PointSet set = bare_set(cloud, normals, sound_points(cloud, normals, counts), options.grid);
  if (counts.without_normal > 0 && set.empty()) throw InvalidInput("fit: every normal is zero or not finite");
  require_two(set);

  Neighbourhoods hoods;
  std::vector<std::size_t> members = all_of(set);
  find_neighbours(set, members, points::NeighbourSearch(positions(set)), options.neighbours, hoods, run);
  run.progress(0.4, "neighbours");
  if (options.outlier_ratio > 0) {
    const std::vector<bool> off = stand_off(hoods, options.outlier_ratio, run);
    std::erase_if(members, [&](std::size_t i) { return off[i]; });
    counts.outliers = set.size() - members.size();
    if (counts.outliers > 0) {
      set.keep(members);
      require_two(set);
      members = all_of(set);
      find_neighbours(set, members, points::NeighbourSearch(positions(set)), options.neighbours, hoods, run);
    }
  }
  find_offsets(set, members, hoods, run);
  run.progress(0.6, "fitting");
  solve(set, members, members.size(), hoods, options, run);
  counts.domains = set.size();
  for (std::size_t i = 0; i < set.size(); ++i) counts.border += set.border(i) != Vec3::Zero() ? 1 : 0;
  if (report != nullptr) *report = counts;
  run.progress(1);
  return set;
}

void refit(PointSet& set, std::span<const std::size_t> touched, const points::NeighbourSearch& search,
           const FitOptions& options, RunControl run) {
  check(options);
  if (options.grid != set.grid) throw InvalidInput("refit: the grid must stay as it is");
  require_two(set);
  if (touched.empty()) return;
  // Off-surface points come from the neighbours' neighbours: those join as members after the touched ones.
  Neighbourhoods hoods;
  std::vector<std::size_t> members(touched.begin(), touched.end());
  find_neighbours(set, members, search, options.neighbours, hoods, run);
  constexpr std::uint32_t kNone = 0xffffffffu;
  hoods.slot.assign(set.size(), kNone);
  for (std::size_t m = 0; m < members.size(); ++m) hoods.slot[members[m]] = static_cast<std::uint32_t>(m);
  for (const std::uint32_t j : hoods.index)
    if (hoods.slot[j] == kNone) {
      hoods.slot[j] = static_cast<std::uint32_t>(members.size());
      members.push_back(j);
    }
  find_neighbours(set, members, search, options.neighbours, hoods, run);
  find_offsets(set, members, hoods, run);
  solve(set, members, touched.size(), hoods, options, run);
}

}  // namespace meniscus::pointset
