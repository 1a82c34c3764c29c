#include <meniscus/mesh/adjacency.h>
#include <meniscus/mesh/components.h>
#include <meniscus/mesh/validate.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace meniscus::mesh {
namespace {

bool in_range(const Triangle& t, std::size_t vertices) {
  return std::all_of(t.begin(), t.end(), [&](std::int32_t v) { return v >= 0 && static_cast<std::size_t>(v) < vertices; });
}

bool zero_area(const Mesh& mesh, const Triangle& t) {
  const Vec3& a = mesh.positions[static_cast<std::size_t>(t[0])];
  const Vec3& b = mesh.positions[static_cast<std::size_t>(t[1])];
  const Vec3& c = mesh.positions[static_cast<std::size_t>(t[2])];
  // Sides relative to the longest one: no overflow or underflow at any scale.
  const double longest =
      std::max({(b - a).lpNorm<Eigen::Infinity>(), (c - a).lpNorm<Eigen::Infinity>(), (c - b).lpNorm<Eigen::Infinity>()});
  if (!std::isfinite(longest)) return false;  // counted as not finite
  if (longest == 0) return true;
  const Vec3 u = (b - a) / longest;
  const Vec3 v = (c - a) / longest;
  return u.cross(v).norm() < 1e-12;
}

/// The triangles that can be talked about, with a note of the others in `audit`.
Mesh usable_part(const Mesh& mesh, Audit& audit) {
  Mesh part;
  part.positions = mesh.positions;
  part.triangles.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    if (!in_range(t, mesh.positions.size())) {
      ++audit.out_of_range_triangles;
    } else if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) {
      ++audit.repeated_vertices;
    } else {
      part.triangles.push_back(t);
      if (zero_area(mesh, t)) ++audit.zero_area_triangles;
    }
  }
  return part;
}

std::size_t count_duplicates(const Mesh& mesh, const IndexLists& triangles_of) {
  std::size_t duplicates = 0;
  std::vector<std::pair<std::int32_t, std::int32_t>> others;
  for (std::size_t v = 0; v < triangles_of.size(); ++v) {
    others.clear();
    for (const std::int32_t t : triangles_of[v]) {
      Triangle sorted = mesh.triangles[static_cast<std::size_t>(t)];
      std::sort(sorted.begin(), sorted.end());
      if (static_cast<std::size_t>(sorted[0]) == v) others.emplace_back(sorted[1], sorted[2]);
    }
    std::sort(others.begin(), others.end());
    for (std::size_t i = 1; i < others.size(); ++i) duplicates += others[i] == others[i - 1] ? 1 : 0;
  }
  return duplicates;
}

/// Whether the triangles at `v` are one fan: the sides opposite v form one path or one cycle.
class FanCheck {
 public:
  bool one_fan(const Mesh& mesh, std::span<const std::int32_t> triangles, std::int32_t v) {
    sides_.clear();
    ends_.clear();
    for (const std::int32_t t : triangles) {
      const Triangle& tri = mesh.triangles[static_cast<std::size_t>(t)];
      const std::size_t c = tri[0] == v ? 0 : tri[1] == v ? 1 : 2;
      ends_.emplace_back(tri[(c + 1) % 3], sides_.size());
      ends_.emplace_back(tri[(c + 2) % 3], sides_.size());
      sides_.push_back(sides_.size());
    }
    // Sides that share an end belong together; an end shared by more than two is no fan.
    std::sort(ends_.begin(), ends_.end());
    std::size_t pieces = sides_.size();
    for (std::size_t i = 1; i < ends_.size(); ++i) {
      if (ends_[i].first != ends_[i - 1].first) continue;
      if (i > 1 && ends_[i].first == ends_[i - 2].first) return false;
      const std::size_t p = root(ends_[i].second);
      const std::size_t q = root(ends_[i - 1].second);
      if (p == q) continue;
      sides_[std::max(p, q)] = std::min(p, q);
      --pieces;
    }
    return pieces <= 1;
  }

 private:
  std::size_t root(std::size_t i) {
    while (sides_[i] != i) i = sides_[i] = sides_[sides_[i]];
    return i;
  }
  std::vector<std::size_t> sides_;                          // disjoint sets
  std::vector<std::pair<std::int32_t, std::size_t>> ends_;  // (end vertex, side)
};

void audit_attributes(const Mesh& mesh, Audit& audit) {
  for (const Attribute& a : mesh.attributes) {
    if (a.size() != mesh.positions.size()) audit.attribute_mismatches.push_back(a.name);
    if (a.is_integer()) continue;
    for (const double value : std::get<0>(a.data)) audit.nonfinite_attributes += std::isfinite(value) ? 0 : 1;
  }
}

void audit_edges(const Mesh& mesh, Audit& audit) {
  const std::vector<Edge> all = edges(mesh);
  audit.edges = all.size();
  for (const Edge& e : all) {
    if (e.uses() == 1) ++audit.boundary_edges;
    if (e.uses() > 2) ++audit.nonmanifold_edges;
    if (e.uses() == 2 && e.forward != 1) ++audit.misoriented_edges;
  }
}

void audit_vertices(const Mesh& mesh, Audit& audit) {
  const IndexLists triangles_of = vertex_triangles(mesh);
  audit.duplicate_triangles = count_duplicates(mesh, triangles_of);
  FanCheck check;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    if (!mesh.positions[v].allFinite()) ++audit.nonfinite_vertices;
    if (triangles_of[v].empty()) {
      ++audit.unused_vertices;
    } else if (!check.one_fan(mesh, triangles_of[v], static_cast<std::int32_t>(v))) {
      ++audit.nonmanifold_vertices;
    }
  }
  audit.vertices = mesh.positions.size() - audit.unused_vertices;
}

std::string counted(std::size_t n, const std::string& what) { return std::to_string(n) + " " + what + (n == 1 ? "" : "s"); }

}  // namespace

bool Audit::good() const {
  return closed() && manifold() && oriented() && finite() && !degenerate() && out_of_range_triangles == 0 &&
         attribute_mismatches.empty();
}

Audit validate(const Mesh& mesh) {
  Audit audit;
  const Mesh part = usable_part(mesh, audit);
  audit.triangles = part.triangles.size();
  audit_attributes(mesh, audit);
  audit_edges(part, audit);
  audit_vertices(part, audit);
  audit.components = components(part).count;
  audit.euler =
      static_cast<long long>(audit.vertices) - static_cast<long long>(audit.edges) + static_cast<long long>(audit.triangles);
  if (audit.closed() && audit.manifold() && audit.oriented())
    audit.genus = static_cast<long long>(audit.components) - audit.euler / 2;
  return audit;
}

std::string summary(const Audit& audit) {
  std::string text = audit.closed() ? "closed" : "open";
  text += audit.manifold() ? ", manifold" : ", not manifold";
  text += audit.oriented() ? ", oriented: " : ", not consistently oriented: ";
  text += counted(audit.components, "component");
  if (audit.genus) text += ", genus " + std::to_string(*audit.genus);
  text += ", " + std::to_string(audit.vertices) + (audit.vertices == 1 ? " vertex" : " vertices");
  text += ", " + counted(audit.triangles, "triangle");

  const auto add = [&](std::size_t n, const std::string& what) {
    if (n > 0) text += "; " + counted(n, what);
  };
  add(audit.out_of_range_triangles, "out-of-range triangle");
  add(audit.repeated_vertices, "collapsed triangle");
  add(audit.zero_area_triangles, "zero-area triangle");
  add(audit.duplicate_triangles, "duplicate triangle");
  add(audit.nonfinite_vertices, "non-finite vertex position");
  add(audit.nonfinite_attributes, "non-finite attribute value");
  add(audit.unused_vertices, "unused vertex position");
  add(audit.boundary_edges, "boundary edge");
  add(audit.nonmanifold_edges, "non-manifold edge");
  add(audit.misoriented_edges, "misoriented edge");
  add(audit.nonmanifold_vertices, "non-manifold vertex fan");
  for (const std::string& name : audit.attribute_mismatches) text += "; attribute " + name + " has the wrong size";
  return text;
}

}  // namespace meniscus::mesh
