#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>
#include <meniscus/sample/evenness.h>
#include <meniscus/sample/particle_mesh.h>
#include <meniscus/sample/surface_cell.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>

namespace meniscus::sample {
namespace {

constexpr std::size_t kLongestGap = 12;  // edges of a gap that is closed
constexpr int kRepairs = 4;

struct Sheet {
  SurfacePoints points;
  std::vector<double> spacing;
};

Sheet sheet_of(const points::Cloud& cloud) {
  const auto normals = cloud.attributes.values(attribute::kNormal, 3);
  const auto radii = cloud.attributes.values(attribute::kRadius, 1);
  if (!cloud.empty() && (normals.empty() || radii.empty()))
    throw InvalidInput("a mesh of particles needs the attributes N and pscale");
  Sheet s;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    s.points.push_back(cloud.positions[i], Vec3(normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]));
    s.spacing.push_back(2 * radii[i]);
  }
  return s;
}

/// The triangle with its smallest index first, orientation kept.
Triangle canonical(Triangle t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

/// Every particle's own fan of triangles, from consecutive sides of its cell.
std::vector<Triangle> proposals(const Sheet& s, const Box& box, const RunControl& run) {
  const Neighbours near = cell_neighbours(s.points, s.spacing, run);
  constexpr std::size_t kBlock = 256;
  std::vector<std::vector<Triangle>> fans((s.points.size() + kBlock - 1) / kBlock);
  parallel_blocks(s.points.size(), kBlock, run, [&](std::size_t begin, std::size_t end) {
    SurfaceCell cell;
    for (std::size_t i = begin; i < end; ++i) {
      cell.build(s.points, i, near.of(i), 1.25 * s.spacing[i], box);
      for (int k = 0; k < cell.sides(); ++k) {
        const std::int64_t a = cell.side(k), b = cell.side(k + 1 == cell.sides() ? 0 : k + 1);
        if (a < 0 || b < 0 || a == b) continue;
        fans[begin / kBlock].push_back(
            canonical({static_cast<std::int32_t>(i), static_cast<std::int32_t>(a), static_cast<std::int32_t>(b)}));
      }
    }
  });
  std::vector<Triangle> all;
  for (const auto& f : fans) all.insert(all.end(), f.begin(), f.end());
  std::sort(all.begin(), all.end());
  return all;
}

using Edge = std::pair<std::int32_t, std::int32_t>;

/// Directed edges in use: an oriented manifold has each at most once.
class Assembly {
 public:
  explicit Assembly(const SurfacePoints& points) : points_(points) {}

  bool add(const Triangle& t) {
    for (std::size_t k = 0; k < 3; ++k)
      if (used_.count({t[k], t[(k + 1) % 3]}) != 0) return false;
    // Nor its own reverse: a triangle with two faces encloses nothing.
    const auto back = used_.find({t[1], t[0]});
    if (back != used_.end()) {
      const Triangle& r = triangles_[static_cast<std::size_t>(back->second)];
      if (std::find(r.begin(), r.end(), t[2]) != r.end()) return false;
    }
    const Vec3 a = at(t[0]), normal = (at(t[1]) - a).cross(at(t[2]) - a);
    if (!(normal.norm() > 0)) return false;
    for (std::size_t k = 0; k < 3; ++k) used_[{t[k], t[(k + 1) % 3]}] = static_cast<std::int32_t>(triangles_.size());
    triangles_.push_back(t);
    return true;
  }

  /// Directed edges that lack their opposite, turned around: the outlines of gaps.
  std::map<std::int32_t, std::vector<std::int32_t>> outlines() const {
    std::map<std::int32_t, std::vector<std::int32_t>> next;
    for (const auto& [e, t] : used_)
      if (used_.count({e.second, e.first}) == 0) next[e.second].push_back(e.first);
    return next;
  }

  /// Closes a gap by cutting off its best ear until three corners are left.
  std::size_t fill(std::vector<std::int32_t> loop) {
    std::size_t made = 0;
    while (loop.size() >= 3) {
      std::size_t best = loop.size();
      double best_quality = -1;
      for (std::size_t k = 0; k < loop.size(); ++k) {
        const Triangle t = ear(loop, k);
        const bool blocked = loop.size() > 3 && used_.count({t[0], t[2]}) + used_.count({t[2], t[0]}) > 0;
        const double q = blocked ? -1 : quality(t);
        if (q > best_quality) {
          best_quality = q;
          best = k;
        }
      }
      if (best == loop.size() || !add(ear(loop, best))) break;
      ++made;
      if (loop.size() == 3) break;
      loop.erase(loop.begin() + static_cast<std::ptrdiff_t>(best));
    }
    return made;
  }

  /// Where several fans of triangles meet in one vertex, keeps the largest. Returns how many triangles went.
  std::size_t separate_fans() {
    std::vector<std::vector<std::int32_t>> incident(points_.size());
    for (std::size_t t = 0; t < triangles_.size(); ++t)
      for (const std::int32_t v : triangles_[t])
        incident[static_cast<std::size_t>(v)].push_back(static_cast<std::int32_t>(t));
    std::vector<std::uint8_t> gone(triangles_.size(), 0);
    for (std::size_t v = 0; v < incident.size(); ++v)
      for (const std::int32_t t : lesser_fans(static_cast<std::int32_t>(v), incident[v]))
        gone[static_cast<std::size_t>(t)] = 1;
    std::vector<Triangle> kept;
    for (std::size_t t = 0; t < triangles_.size(); ++t)
      if (!gone[t]) kept.push_back(triangles_[t]);
    const std::size_t removed = triangles_.size() - kept.size();
    if (removed == 0) return 0;
    triangles_.clear();
    used_.clear();
    for (const Triangle& t : kept) add(t);
    return removed;
  }

  const std::vector<Triangle>& triangles() const { return triangles_; }
  bool has(const Edge& e) const { return used_.count(e) != 0; }
  const std::map<Edge, std::int32_t>& edges() const { return used_; }

 private:
  /// The triangles about v outside its largest fan.
  std::vector<std::int32_t> lesser_fans(std::int32_t v, std::vector<std::int32_t> around) const {
    std::vector<std::int32_t> largest, rest;
    while (!around.empty()) {
      // Grow one fan across the edges at v.
      std::vector<std::int32_t> fan{around.back()};
      around.pop_back();
      for (std::size_t k = 0; k < fan.size(); ++k)
        for (auto t = around.begin(); t != around.end();) {
          const bool touches = shares_edge_at(v, fan[k], *t);
          if (touches) fan.push_back(*t);
          t = touches ? around.erase(t) : t + 1;
        }
      if (fan.size() > largest.size()) largest.swap(fan);
      rest.insert(rest.end(), fan.begin(), fan.end());
    }
    return rest;
  }
  bool shares_edge_at(std::int32_t v, std::int32_t s, std::int32_t t) const {
    for (const std::int32_t a : triangles_[static_cast<std::size_t>(s)])
      for (const std::int32_t b : triangles_[static_cast<std::size_t>(t)])
        if (a == b && a != v) return true;
    return false;
  }
  Vec3 at(std::int32_t i) const { return points_.position(static_cast<std::size_t>(i)); }
  static Triangle ear(const std::vector<std::int32_t>& loop, std::size_t k) {
    const std::size_t n = loop.size();
    return {loop[(k + n - 1) % n], loop[k], loop[(k + 1) % n]};
  }
  /// Positive for triangles that face as their corners do; 1 for equilateral ones.
  double quality(const Triangle& t) const {
    const Vec3 a = at(t[0]), b = at(t[1]), c = at(t[2]), n = (b - a).cross(c - a);
    Vec3 mean = Vec3::Zero();
    for (const std::int32_t v : t) mean += points_.normal(static_cast<std::size_t>(v));
    const double edges = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
    return edges > 0 ? 2 * std::sqrt(3.0) * n.dot(mean.normalized()) / edges : -1;
  }

  const SurfacePoints& points_;
  std::map<Edge, std::int32_t> used_;
  std::vector<Triangle> triangles_;
};

/// Does the surface end at an edge between a and b: is its middle within a spacing of a face of the box?
bool near_face(const Box& box, const Vec3& a, const Vec3& b, double spacing) {
  const Vec3 p = 0.5 * (a + b);
  return ((p - box.min).array() <= spacing).any() || ((box.max - p).array() <= spacing).any();
}

/// Follows each outline once around; outlines that touch at a vertex are followed separately as far as they can be told
/// apart.
std::size_t close_gaps(Assembly& assembly) {
  std::map<std::int32_t, std::vector<std::int32_t>> next = assembly.outlines();
  std::size_t made = 0;
  for (auto& [start, exits] : next) {
    while (!exits.empty()) {
      std::vector<std::int32_t> loop{start};
      std::int32_t at = start;
      bool closed = false;
      while (!next[at].empty()) {
        const std::int32_t to = next[at].back();
        next[at].pop_back();
        if (to == start) {
          closed = true;
          break;
        }
        const auto again = std::find(loop.begin(), loop.end(), to);
        if (again != loop.end()) {  // a smaller loop inside: fill it and go on from its knot
          std::vector<std::int32_t> inner(again, loop.end());
          if (inner.size() <= kLongestGap) made += assembly.fill(inner);
          loop.erase(again + 1, loop.end());
        } else {
          loop.push_back(to);
        }
        at = to;
      }
      if (closed && loop.size() <= kLongestGap) made += assembly.fill(loop);
    }
  }
  return made;
}

}  // namespace

mesh::Mesh particle_mesh(const points::Cloud& sampling, const Box& box, ParticleMeshReport* report, const RunControl& run) {
  const Sheet sheet = sheet_of(sampling);
  const std::vector<Triangle> all = proposals(sheet, box, run);

  // Triangles on which all three corners agree, then those with two votes that fit, then what closes the gaps.
  Assembly assembly(sheet.points);
  for (const std::ptrdiff_t votes : {3, 2})
    for (auto t = all.begin(); t != all.end();) {
      const auto end = std::upper_bound(t, all.end(), *t);
      if (end - t == votes) assembly.add(*t);
      t = end;
    }
  std::size_t filled = close_gaps(assembly);
  for (int round = 0; round < kRepairs && assembly.separate_fans() > 0; ++round) filled += close_gaps(assembly);
  while (assembly.separate_fans() > 0) {
  }

  mesh::Mesh mesh;
  mesh.positions = sampling.positions;
  mesh.attributes = sampling.attributes;
  mesh.triangles = assembly.triangles();
  if (!report) return mesh;
  *report = {};
  report->filled = filled;
  std::vector<std::uint8_t> used(sampling.size(), 0);
  for (const Triangle& t : mesh.triangles)
    for (const std::int32_t v : t) used[static_cast<std::size_t>(v)] = 1;
  report->unused = static_cast<std::size_t>(std::count(used.begin(), used.end(), 0));
  for (const auto& [e, t] : assembly.edges()) {
    if (assembly.has({e.second, e.first})) continue;
    const auto a = static_cast<std::size_t>(e.first), b = static_cast<std::size_t>(e.second);
    const bool border =
        near_face(box, sampling.positions[a], sampling.positions[b], std::min(sheet.spacing[a], sheet.spacing[b]));
    ++(border ? report->border_edges : report->open_edges);
  }
  return mesh;
}

}  // namespace meniscus::sample
