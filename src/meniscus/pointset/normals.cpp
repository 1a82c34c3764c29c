#include <meniscus/pointset/normals.h>

#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>
#include <meniscus/points/neighbours.h>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <tuple>

namespace meniscus::pointset {
namespace {

constexpr std::size_t kBlock = 256;
constexpr std::size_t kFewNeighbours = 8;
// Coordinates beyond this have no squares.
constexpr double kFarthest = 1e100;
// A neighbourhood lies on a line when its second extent is below this share of its first.
constexpr double kLine = 1e-5;
// A neighbourhood is no sheet when its square extent across, the point's own distance included, is above this share of that
// along.
constexpr double kSheet = 0.05;
constexpr int kPasses = 8;

using points::NeighbourLists;

void keep(points::Cloud& cloud, const std::vector<char>& wanted) {
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < wanted.size(); ++i)
    if (wanted[i]) indices.push_back(i);
  if (indices.size() < cloud.size()) cloud = points::gathered(cloud, indices);
}

std::size_t drop_not_finite(points::Cloud& cloud) {
  std::vector<char> wanted(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) wanted[i] = cloud.positions[i].cwiseAbs().maxCoeff() <= kFarthest;
  const std::size_t before = cloud.size();
  keep(cloud, wanted);
  return before - cloud.size();
}

std::size_t drop_coincident(points::Cloud& cloud) {
  const std::vector<Vec3>& p = cloud.positions;
  std::vector<std::uint32_t> order(p.size());
  std::iota(order.begin(), order.end(), std::uint32_t{0});
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::tie(p[a].x(), p[a].y(), p[a].z(), a) < std::tie(p[b].x(), p[b].y(), p[b].z(), b);
  });
  std::vector<char> wanted(p.size(), 1);
  for (std::size_t k = 1; k < order.size(); ++k) wanted[order[k]] = p[order[k]] != p[order[k - 1]];
  const std::size_t before = cloud.size();
  keep(cloud, wanted);
  return before - cloud.size();
}

double mean_distance(const points::Cloud& cloud, const NeighbourLists& lists, std::size_t i) {
  double sum = 0;
  for (const std::uint32_t j : lists.of(i)) sum += (cloud.positions[j] - cloud.positions[i]).norm();
  return sum / static_cast<double>(std::max<std::size_t>(1, lists.of(i).size()));
}

/// Whether point i is off every sheet: its neighbours make no plane that it lies near.
bool off_sheet(const points::Cloud& cloud, const NeighbourLists& lists, std::size_t i) {
  const auto near = lists.of(i);
  Vec3 mean = Vec3::Zero();
  for (const std::uint32_t j : near) mean += (cloud.positions[j] - cloud.positions[i]) / static_cast<double>(near.size());
  Mat3 spread = Mat3::Zero();
  for (const std::uint32_t j : near) {
    const Vec3 d = cloud.positions[j] - cloud.positions[i] - mean;
    spread += d * d.transpose() / static_cast<double>(near.size());
  }
  Eigen::SelfAdjointEigenSolver<Mat3> eigen(spread);
  const double across = mean.dot(eigen.eigenvectors().col(0));
  return across * across + eigen.eigenvalues()[0] > kSheet * eigen.eigenvalues()[1];
}

/// One pass of drop_outliers; those that hide behind others are seen in the next.
std::size_t drop_outmost(points::Cloud& cloud, const NeighbourLists& lists, double ratio, const RunControl& run) {
  const std::size_t n = cloud.size();
  std::vector<double> usual(n);
  parallel_for(n, kBlock, run, [&](std::size_t i) { usual[i] = mean_distance(cloud, lists, i); });
  std::vector<double> sorted = usual;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(n / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  std::vector<char> wanted(n);
  parallel_for(n, kBlock, run, [&](std::size_t i) {
    double least = std::min(usual[i], 2 * *middle);
    for (const std::uint32_t j : lists.of(i)) least = std::min(least, usual[j]);
    wanted[i] = usual[i] <= ratio * least || !off_sheet(cloud, lists, i);
  });
  keep(cloud, wanted);
  return n - cloud.size();
}

/// Drops points that are far from all others, measured by how far these are from theirs. Leaves the lists of the rest.
std::size_t drop_outliers(points::Cloud& cloud, NeighbourLists& lists, double ratio, const RunControl& run) {
  const std::size_t before = cloud.size();
  for (int pass = 0; pass < kPasses && cloud.size() > kFewNeighbours && std::isfinite(ratio); ++pass) {
    if (drop_outmost(cloud, lists, ratio, run) == 0) break;
    lists = points::nearest_neighbours(cloud.positions, kFewNeighbours, run);
  }
  return before - cloud.size();
}

struct Plane {
  Vec3 normal = Vec3::Zero();
  double thinness = 0;  // extent across over extent along, squared
  bool found = false;
};

/// The plane of a point and its nearest neighbours, weighted by a bell that ends beyond the farthest.
Plane plane_of(const Vec3& p, std::span<const std::uint32_t> near, const std::vector<Vec3>& positions) {
  Plane plane;
  if (near.size() < 2) return plane;
  const double reach = 1.3 * (positions[near.back()] - p).norm();
  double total = 1;
  Vec3 mean = Vec3::Zero();
  Mat3 second = Mat3::Zero();
  for (const std::uint32_t j : near) {
    const Vec3 d = (positions[j] - p) / reach;
    const double w = std::pow(1 - d.squaredNorm(), 2);
    total += w;
    mean += w * d;
    second += w * d * d.transpose();
  }
  const Mat3 spread = second / total - (mean / total) * (mean / total).transpose();
  Eigen::SelfAdjointEigenSolver<Mat3> eigen(spread);
  const Vec3& extent = eigen.eigenvalues();
  if (!(extent[1] > kLine * kLine * extent[2])) return plane;
  plane.normal = eigen.eigenvectors().col(0);
  plane.thinness = std::max(0.0, extent[0]) / extent[1];
  plane.found = true;
  return plane;
}

Plane best_plane(std::size_t i, const NeighbourLists& lists, const std::vector<Vec3>& positions) {
  const auto near = lists.of(i);
  Plane best;
  for (const std::size_t share : {1u, 2u, 4u}) {
    const std::size_t count = std::min(near.size(), std::max<std::size_t>(near.size() / share, kFewNeighbours));
    const Plane plane = plane_of(positions[i], near.first(count), positions);
    if (plane.found && (!best.found || plane.thinness < best.thinness)) best = plane;
  }
  return best;
}

/// A relation of two points: what one normal says of the other's sign, and how little that is to be trusted.
struct Relation {
  double doubt;
  std::uint32_t a, b;
  bool opposite;
};

Relation relate(std::uint32_t a, std::uint32_t b, const std::vector<Vec3>& positions, const std::vector<Vec3>& normals) {
  const Vec3 e = (positions[b] - positions[a]).normalized();
  const double along_a = e.dot(normals[a]), along_b = e.dot(normals[b]);
  const double agreement = normals[a].dot(normals[b]);
  return {1 - std::abs(agreement) + along_a * along_a + along_b * along_b, a, b, agreement < 0};
}

std::vector<Relation> relate_all(const NeighbourLists& lists, const std::vector<Vec3>& positions,
                                 const std::vector<Vec3>& normals, const RunControl& run) {
  // An edge may stand twice, once from each end; the spanning tree does not mind.
  std::vector<Relation> all(lists.index.size());
  parallel_for(lists.size(), kBlock, run, [&](std::size_t i) {
    for (std::size_t k = lists.begin[i]; k < lists.begin[i + 1]; ++k) {
      const std::uint32_t j = lists.index[k], me = static_cast<std::uint32_t>(i);
      all[k] = relate(std::min(me, j), std::max(me, j), positions, normals);
    }
  });
  return all;
}

/// Sets that can be joined with a relative sign (union-find with parity).
class SignedSets {
 public:
  explicit SignedSets(std::size_t size) : parent_(size), turned_(size, false) {
    std::iota(parent_.begin(), parent_.end(), std::uint32_t{0});
  }
  struct Root {
    std::uint32_t set;
    bool turned;
  };
  Root root(std::uint32_t i) {
    bool turned = false;
    std::uint32_t r = i;
    for (; parent_[r] != r; r = parent_[r]) turned ^= turned_[r];
    // Point all that was passed at the root.
    for (bool rest = turned; parent_[i] != i;) {
      const std::uint32_t next = parent_[i];
      const bool step = turned_[i];
      parent_[i] = r;
      turned_[i] = rest;
      rest ^= step;
      i = next;
    }
    return {r, turned};
  }
  void join(const Root& a, const Root& b, bool opposite) {
    const bool turned = a.turned ^ b.turned ^ opposite;
    parent_[std::max(a.set, b.set)] = std::min(a.set, b.set);
    turned_[std::max(a.set, b.set)] = turned;
  }

 private:
  std::vector<std::uint32_t> parent_;
  std::vector<bool> turned_;
};

/// Signs along the minimum spanning forest (Kruskal). Point n, if given, stands for all given normals: their signs are set.
SignedSets spanning_signs(std::vector<Relation> relations, const std::vector<char>& fixed) {
  std::sort(relations.begin(), relations.end(),
            [](const Relation& x, const Relation& y) { return std::tie(x.doubt, x.a, x.b) < std::tie(y.doubt, y.a, y.b); });
  SignedSets sets(fixed.size() + 1);
  const auto anchor = static_cast<std::uint32_t>(fixed.size());
  for (std::uint32_t i = 0; i < anchor; ++i)
    if (fixed[i]) sets.join(sets.root(i), sets.root(anchor), false);
  for (const Relation& r : relations) {
    const auto a = sets.root(r.a), b = sets.root(r.b);
    if (a.set != b.set) sets.join(a, b, r.opposite);
  }
  return sets;
}

constexpr std::size_t kDirections = 26;

/// The directions to the corners, edges and faces of a cube.
std::array<Vec3, kDirections> directions() {
  std::array<Vec3, kDirections> all;
  std::size_t k = 0;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z)
        if (x != 0 || y != 0 || z != 0) all[k++] = Vec3(x, y, z).normalized();
  return all;
}

/// Turns the pieces without given normals so that their outermost points face outwards. Returns the number of pieces.
std::size_t face_outwards(const std::vector<Vec3>& positions, const std::vector<std::uint32_t>& piece,
                          const std::vector<char>& fixed, std::vector<Vec3>& normals) {
  const auto look = directions();
  const std::size_t n = positions.size();
  constexpr std::uint32_t kNone = ~std::uint32_t{0};
  std::vector<std::uint32_t> number(n, kNone);  // by the piece's root
  std::vector<char> has_fixed;
  std::vector<std::array<std::uint32_t, kDirections>> outermost;
  for (std::uint32_t i = 0; i < n; ++i) {
    std::uint32_t& id = number[piece[i]];
    if (id == kNone) {
      id = static_cast<std::uint32_t>(outermost.size());
      outermost.emplace_back().fill(i);
      has_fixed.push_back(0);
    }
    if (fixed[i]) has_fixed[id] = 1;
    for (std::size_t k = 0; k < kDirections; ++k)
      if (look[k].dot(positions[i] - positions[outermost[id][k]]) > 0) outermost[id][k] = i;
  }
  std::vector<char> turn(outermost.size(), 0);
  for (std::size_t id = 0; id < outermost.size(); ++id) {
    double outwards = 0;
    for (std::size_t k = 0; k < kDirections; ++k) outwards += look[k].dot(normals[outermost[id][k]]);
    turn[id] = !has_fixed[id] && outwards < 0;
  }
  for (std::size_t i = 0; i < n; ++i)
    if (turn[number[piece[i]]]) normals[i] = -normals[i];
  return static_cast<std::size_t>(std::count(has_fixed.begin(), has_fixed.end(), 0));
}

/// Orients the normals that are not fixed. Returns the number of pieces without a fixed one.
std::size_t orient(const std::vector<Relation>& relations, const std::vector<Vec3>& positions,
                   const std::vector<char>& fixed, std::vector<Vec3>& normals) {
  SignedSets sets = spanning_signs(relations, fixed);
  const std::uint32_t anchor = static_cast<std::uint32_t>(fixed.size());
  const bool flipped_anchor = sets.root(anchor).turned;
  std::vector<std::uint32_t> piece(fixed.size());
  for (std::uint32_t i = 0; i < fixed.size(); ++i) {
    const auto root = sets.root(i);
    piece[i] = root.set;
    const bool turned = root.turned ^ (root.set == sets.root(anchor).set && flipped_anchor);
    if (turned && !fixed[i]) normals[i] = -normals[i];
  }
  return face_outwards(positions, piece, fixed, normals);
}

/// How many normals the trusted relations to the neighbours contradict on the whole.
std::size_t count_failed(const std::vector<Relation>& relations, const std::vector<Vec3>& positions,
                         const std::vector<Vec3>& normals) {
  std::vector<double> support(normals.size(), 0);
  for (const Relation& r : relations) {
    if (r.doubt >= 1) continue;
    const double agreement = relate(r.a, r.b, positions, normals).opposite ? r.doubt - 1 : 1 - r.doubt;
    support[r.a] += agreement;
    support[r.b] += agreement;
  }
  return static_cast<std::size_t>(std::count_if(support.begin(), support.end(), [](double s) { return s < 0; }));
}

/// Unit normals from attribute N; zero where there is none that can be used.
std::vector<Vec3> given_normals(const points::Cloud& cloud, bool use, NormalReport& report) {
  std::vector<Vec3> normals(cloud.size(), Vec3::Zero());
  const auto values = cloud.attributes.values(attribute::kNormal, 3);
  if (!use || values.empty()) return normals;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const Vec3 n(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
    const double largest = n.cwiseAbs().maxCoeff();
    if (!n.allFinite() || largest < std::numeric_limits<double>::min()) {
      ++report.zero_normals;
      continue;
    }
    normals[i] = (n / largest).normalized();
    ++report.given;
  }
  return normals;
}

void set_normals(points::Cloud& cloud, const std::vector<Vec3>& normals) {
  std::vector<double> values;
  values.reserve(3 * normals.size());
  for (const Vec3& n : normals) values.insert(values.end(), {n.x(), n.y(), n.z()});
  cloud.attributes.set(attribute::kNormal, 3, std::move(values));
}

/// Estimates what is zero in `normals`; drops the points where that cannot be done.
void estimate_missing(points::Cloud& cloud, std::vector<Vec3>& normals, NeighbourLists& lists, std::size_t neighbours,
                      std::vector<char>& fixed, NormalReport& report, const RunControl& run) {
  std::vector<char> wanted(cloud.size(), 1);
  parallel_for(cloud.size(), kBlock, run, [&](std::size_t i) {
    if (normals[i] != Vec3::Zero()) return;
    const Plane plane = best_plane(i, lists, cloud.positions);
    normals[i] = plane.normal;
    wanted[i] = plane.found;
  });
  report.undetermined = static_cast<std::size_t>(std::count(wanted.begin(), wanted.end(), 0));
  if (report.undetermined == 0) return;
  keep(cloud, wanted);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i)
    if (wanted[i]) fixed[kept++] = fixed[i];
  fixed.resize(kept);
  std::erase(normals, Vec3(Vec3::Zero()));
  lists = points::nearest_neighbours(cloud.positions, neighbours, run);
}

}  // namespace

points::Cloud with_normals(const points::Cloud& cloud, const NormalOptions& options, NormalReport* report,
                           const RunControl& run) {
  if (options.neighbours < 3) throw InvalidInput("a plane needs three neighbours or more");
  if (!(options.outlier_ratio > 1)) throw InvalidInput("the ratio that makes a point an outlier must be above 1");
  NormalReport found;
  points::Cloud out = cloud;
  found.not_finite = drop_not_finite(out);
  found.coincident = drop_coincident(out);
  NeighbourLists lists = points::nearest_neighbours(out.positions, kFewNeighbours, run);
  found.outliers = drop_outliers(out, lists, options.outlier_ratio, run);
  run.progress(0.3, "normals");

  std::vector<Vec3> normals = given_normals(out, options.use_given, found);
  std::vector<char> fixed(normals.size());
  for (std::size_t i = 0; i < normals.size(); ++i) fixed[i] = normals[i] != Vec3::Zero();
  const bool missing = found.given < out.size();
  const auto neighbours = missing ? static_cast<std::size_t>(options.neighbours) : kFewNeighbours;
  if (missing) lists = points::nearest_neighbours(out.positions, neighbours, run);
  if (missing) {
    estimate_missing(out, normals, lists, neighbours, fixed, found, run);
    found.estimated = out.size() - found.given;
  }
  if (out.empty())
    throw InvalidInput("no normal can be told from these points: they are too few, coincide, or lie on a line");
  run.progress(0.6, "normals");
  const std::vector<Relation> relations = relate_all(lists, out.positions, normals, run);
  if (missing) found.pieces = orient(relations, out.positions, fixed, normals);
  found.failed = count_failed(relations, out.positions, normals);
  set_normals(out, normals);
  if (report) *report = found;
  run.progress(1, "normals");
  return out;
}

}  // namespace meniscus::pointset
