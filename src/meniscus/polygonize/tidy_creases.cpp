#include <meniscus/polygonize/tidy_creases.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace meniscus::polygonize {
namespace {

constexpr double kShort = 0.25;      // voxels: crease vertices so near to each other merge
constexpr double kThin = 0.1;        // height over longest side of a triangle that lies along a crease
constexpr double kNoArea = 1e-6;     // the same, of one that hardly has an area
constexpr double kFacing = 0.9;      // cosine of the angle to its sheet's normal beyond which a triangle faces the wrong way
constexpr double kBetter = 1e-6;     // that a flip has to gain
constexpr std::size_t kVisits = 16;  // of a triangle, at most, on average

using Index = std::int32_t;
using Place = std::size_t;

Place at(Index i) { return static_cast<Place>(i); }

/// The triangles about crease vertices, to be edited.
class Tidier {
 public:
  Tidier(const Shell& shell, std::vector<Triangle>& triangles) : shell_(shell), triangles_(triangles) {
    ring_of_.assign(shell.positions.size(), -1);
    for (const Triangle& t : triangles) {
      if (std::none_of(t.begin(), t.end(), [&](Index v) { return creased(v); })) continue;
      for (const Index v : t)
        if (!ringed(v)) ring_of_[at(v)] = static_cast<Index>(rings_++);
    }
    ring_.resize(rings_);
    for (Place t = 0; t < triangles.size(); ++t)
      for (const Index v : triangles[t])
        if (ringed(v)) ring(v).push_back(static_cast<Index>(t));
  }

  void run() {
    for (Place t = 0; t < triangles_.size(); ++t) note(static_cast<Index>(t));
    const std::size_t most = kVisits * queue_.size();
    for (std::size_t n = 0; n < queue_.size() && n < most; ++n)
      if (is_wanting(queue_[n])) mend(queue_[n]);
    std::erase_if(triangles_, [](const Triangle& t) { return t[0] < 0; });
  }

 private:
  bool creased(Index v) const { return is_creased(shell_.placed[at(v)]); }
  bool corner(Index v) const { return shell_.placed[at(v)] == Placed::Corner; }
  const Vec3& position(Index v) const { return shell_.positions[at(v)]; }
  bool ringed(Index v) const { return ring_of_[at(v)] >= 0; }
  std::vector<Index>& ring(Index v) { return ring_[at(ring_of_[at(v)])]; }
  double length(Index a, Index b) const { return (position(a) - position(b)).norm(); }
  const Triangle& triangle(Index t) const { return triangles_[at(t)]; }
  bool alive(Index t) const { return triangle(t)[0] >= 0; }

  /// Height over longest side, and the normal.
  struct Shape {
    double thickness;
    Vec3 normal;
  };
  Shape shape(const Triangle& t) const {
    const Vec3 u = position(t[1]) - position(t[0]), v = position(t[2]) - position(t[0]);
    const Vec3 n = u.cross(v);
    const double longest2 = std::max({u.squaredNorm(), v.squaredNorm(), (v - u).squaredNorm()}), area = n.norm();
    if (!(longest2 > 0)) return {0, Vec3::Zero()};
    return {area / longest2, area > 0 ? Vec3(n / area) : Vec3(Vec3::Zero())};
  }

  /// How well a triangle lies on its sheet, -1 to 1: the cosine of the angle to the normals of its vertices on one sheet;
  /// where all are on creases it may be anything but thin.
  double score(const Triangle& t) const {
    const Shape s = shape(t);
    if (s.thickness < kNoArea) return -1;
    double worst = 1;
    bool smooth = false;
    for (const Index v : t) {
      if (creased(v) || shell_.normals[at(v)].isZero(0)) continue;
      smooth = true;
      worst = std::min(worst, s.normal.dot(shell_.normals[at(v)]));
    }
    return smooth || s.thickness >= kThin ? worst : 0;
  }

  static bool has(const Triangle& t, Index v) { return t[0] == v || t[1] == v || t[2] == v; }
  static std::array<Index, 2> side(const Triangle& t, std::size_t k) { return {t[k], t[(k + 1) % 3]}; }

  bool is_wanting(Index i) const {
    if (!alive(i)) return false;
    const Triangle& t = triangle(i);
    if (std::none_of(t.begin(), t.end(), [&](Index v) { return creased(v); })) return false;
    if (score(t) < kFacing) return true;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [a, b] = side(t, k);
      if (creased(a) && creased(b) && length(a, b) < kShort * shell_.lattice.voxel) return true;
    }
    return false;
  }

  void note(Index t) {
    if (is_wanting(t)) queue_.push_back(t);
  }

  void mend(Index i) {
    const Triangle t = triangle(i);
    std::array<std::size_t, 3> order = {0, 1, 2};
    const auto size = [&](std::size_t k) { return length(side(t, k)[0], side(t, k)[1]); };
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return size(a) < size(b) || (size(a) == size(b) && a < b); });
    const bool along = std::all_of(t.begin(), t.end(), [&](Index v) { return creased(v); });
    if (along && flip(i, order[2])) return;
    for (const std::size_t k : order) {
      const auto [from, to] = side(t, k);
      if (creased(from) && creased(to) && collapse(from, to)) return;
    }
    for (const std::size_t k : {order[2], order[1], order[0]})
      if (flip(i, k)) return;
  }

  /// The other triangle at the edge a, b of triangle i.
  Index across(Index i, Index a, Index b) {
    for (const Index t : ring(ringed(a) ? a : b)) {
      if (t == i) continue;
      const Triangle& other = triangle(t);
      if (has(other, a) && has(other, b)) return t;
    }
    return -1;
  }

  bool connected(Index u, Index v) {
    if (!ringed(u)) std::swap(u, v);
    return std::any_of(ring(u).begin(), ring(u).end(), [&](Index t) { return has(triangle(t), v); });
  }

  void replace(Index t, const Triangle& by) {
    for (const Index v : triangle(t))
      if (ringed(v)) std::erase(ring(v), t);
    triangles_[at(t)] = by;
    for (const Index v : by)
      if (v >= 0 && ringed(v)) ring(v).push_back(t);
  }

  /// Joins the tip of triangle i with the vertex across its side k instead of the ends of that.
  bool flip(Index i, std::size_t k) {
    const auto [a, b] = side(triangle(i), k);
    const Index other = ringed(a) || ringed(b) ? across(i, a, b) : -1;
    if (other < 0) return false;
    const Triangle& t = triangle(other);
    const Index tip = triangle(i)[(k + 2) % 3];
    const Index far = *std::find_if(t.begin(), t.end(), [a = a, b = b](Index v) { return v != a && v != b; });
    if (tip == far || !(ringed(tip) || ringed(far)) || connected(tip, far)) return false;
    const Triangle first = {tip, a, far}, second = {tip, far, b};
    if (!(blame(first) + blame(second) < blame(triangle(i)) + blame(triangle(other)) - kBetter)) return false;
    replace(i, first);
    replace(other, second);
    note(i);
    note(other);
    return true;
  }

  /// Whether the mesh stays a closed manifold if the edge collapses: what is around both its ends is only what is around it.
  bool links_apart(Index u, Index v) {
    std::vector<Index> about_u, about_v;
    std::vector<std::array<Index, 2>> edges_u;
    const auto opposite = [&](Index t, Index corner) {
      const Triangle& c = triangle(t);
      const std::size_t k = c[0] == corner ? 0 : c[1] == corner ? 1 : 2;
      return std::array<Index, 2>{c[(k + 1) % 3], c[(k + 2) % 3]};
    };
    for (const Index t : ring(u)) {
      edges_u.push_back(opposite(t, u));
      about_u.insert(about_u.end(), edges_u.back().begin(), edges_u.back().end());
    }
    for (const Index t : ring(v)) {
      const auto e = opposite(t, v);
      about_v.insert(about_v.end(), e.begin(), e.end());
      if (e[0] == u || e[1] == u) continue;
      for (const auto& f : edges_u)
        if ((f[0] == e[0] && f[1] == e[1]) || (f[0] == e[1] && f[1] == e[0])) return false;
    }
    for (auto* about : {&about_u, &about_v}) {
      std::sort(about->begin(), about->end());
      about->erase(std::unique(about->begin(), about->end()), about->end());
    }
    std::vector<Index> common;
    std::set_intersection(about_u.begin(), about_u.end(), about_v.begin(), about_v.end(), std::back_inserter(common));
    return common.size() == 2;
  }

  double blame(const Triangle& t) const { return std::max(0.0, kFacing - score(t)); }

  /// What is to be said against the triangles around `from`, and against those there would be if it were put into `to`.
  struct Outcome {
    double before = 0, after = 0;
    bool good() const { return after == 0 || after < before - kBetter; }
  };
  Outcome outcome(Index from, Index to) {
    Outcome o;
    for (const Index t : ring(from)) {
      Triangle moved = triangle(t);
      const bool goes = has(moved, to);
      o.before += blame(moved);
      std::replace(moved.begin(), moved.end(), from, to);
      if (!goes) o.after += blame(moved);
    }
    return o;
  }

  /// Merges two crease vertices, whichever way is better.
  bool collapse(Index a, Index b) {
    if (!links_apart(a, b)) return false;
    Index from = a, to = b;
    if (corner(a) || (!corner(b) && outcome(b, a).after < outcome(a, b).after)) std::swap(from, to);
    const double apart = length(a, b), voxel = shell_.lattice.voxel;
    if (corner(from) && apart > 1e-6 * voxel) return false;
    if (!outcome(from, to).good()) return false;
    const std::vector<Index> around = ring(from);
    for (const Index t : around) {
      Triangle moved = triangle(t);
      const bool goes = has(moved, to);
      std::replace(moved.begin(), moved.end(), from, to);
      replace(t, goes ? Triangle{-1, -1, -1} : moved);
      if (!goes) note(t);
    }
    return true;
  }

  const Shell& shell_;
  std::vector<Triangle>& triangles_;
  std::vector<Index> ring_of_;  // by vertex: which of the rings, or -1
  std::size_t rings_ = 0;
  std::vector<std::vector<Index>> ring_;  // triangles around crease vertices and their neighbours
  std::vector<Index> queue_;
};

}  // namespace

void tidy_creases(const Shell& shell, std::vector<Triangle>& triangles) {
  if (shell.normals.empty() || std::none_of(shell.placed.begin(), shell.placed.end(), is_creased)) return;
  Tidier(shell, triangles).run();
}

}  // namespace meniscus::polygonize
