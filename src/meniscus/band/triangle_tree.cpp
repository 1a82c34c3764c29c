#include <meniscus/band/triangle_tree.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace meniscus::band {

namespace {

constexpr std::uint32_t kLeaf = 4;  // triangles
constexpr int kDeepest = 64;        // halving 2^32 triangles takes 32 levels

double squared_distance(const Vec3& p, const Box& box) {
  return (box.min - p).cwiseMax(p - box.max).cwiseMax(0).squaredNorm();
}

/// From p to the segment from a along d.
double squared_distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& d) {
  const double length = d.squaredNorm();
  const double s = length > 0 ? std::clamp(d.dot(p - a) / length, 0.0, 1.0) : 0;
  return (p - a - s * d).squaredNorm();
}

double squared_distance_to_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  // Barycentric coordinates of the foot on the plane. If it lies outside, the nearest point is on an edge beyond which it
  // lies: on one of two at most.
  const double d11 = ab.squaredNorm(), d12 = ab.dot(ac), d22 = ac.squaredNorm(), e1 = ap.dot(ab), e2 = ap.dot(ac);
  const double area = d11 * d22 - d12 * d12;
  const double v = d22 * e1 - d12 * e2, w = d11 * e2 - d12 * e1;
  if (!(area > 1e-14 * d11 * d22))
    return std::min({squared_distance_to_segment(p, a, ab), squared_distance_to_segment(p, a, ac),
                     squared_distance_to_segment(p, b, c - b)});
  double best = std::numeric_limits<double>::infinity();
  if (w < 0) best = squared_distance_to_segment(p, a, ab);
  if (v < 0) best = std::min(best, squared_distance_to_segment(p, a, ac));
  if (v + w > area) best = std::min(best, squared_distance_to_segment(p, b, c - b));
  return best < std::numeric_limits<double>::infinity() ? best : (ap - (v / area) * ab - (w / area) * ac).squaredNorm();
}

}  // namespace

TriangleTree::TriangleTree(const mesh::Mesh& mesh) {
  triangles_.reserve(mesh.triangles.size());
  const auto at = [&](std::int32_t i) { return mesh.positions[static_cast<std::size_t>(i)]; };
  for (const Triangle& t : mesh.triangles) triangles_.push_back({at(t[0]), at(t[1]), at(t[2])});
  if (!triangles_.empty()) build(triangles_, 0, static_cast<std::uint32_t>(triangles_.size()));
}

std::uint32_t TriangleTree::build(std::vector<Corners>& all, std::uint32_t begin, std::uint32_t end) {
  Box box, centers;
  for (std::uint32_t i = begin; i < end; ++i) {
    for (const Vec3& p : {all[i].a, all[i].b, all[i].c}) box.extend(p);
    centers.extend(all[i].a + all[i].b + all[i].c);
  }
  const auto node = static_cast<std::uint32_t>(nodes_.size());
  nodes_.push_back({box, begin, end - begin});
  if (end - begin <= kLeaf) return node;

  Eigen::Index axis = 0;
  centers.size().maxCoeff(&axis);
  const std::uint32_t middle = begin + (end - begin) / 2;
  const auto center = [axis](const Corners& t) { return t.a[axis] + t.b[axis] + t.c[axis]; };
  std::nth_element(all.begin() + begin, all.begin() + middle, all.begin() + end,
                   [&](const Corners& s, const Corners& t) { return center(s) < center(t); });
  build(all, begin, middle);
  const std::uint32_t right = build(all, middle, end);
  nodes_[node].first = right;
  nodes_[node].count = 0;
  return node;
}

Vec3 TriangleTree::normal_towards(const Vec3& p, double bound) const {
  const Corners* t = search(p, bound).triangle;
  if (!t) return Vec3::Zero();
  const Vec3 normal = (t->b - t->a).cross(t->c - t->a).normalized();
  const double height = normal.dot(p - t->a);
  return height > 0 ? normal : height < 0 ? Vec3(-normal) : Vec3(Vec3::Zero());
}

TriangleTree::Hit TriangleTree::search(const Vec3& p, double bound) const {
  double best = bound * bound;
  const Corners* triangle = nullptr;
  if (!nodes_.empty()) descend(p, 0, best, triangle);
  return {triangle ? std::sqrt(best) : bound, triangle};
}

/// Looks through a subtree for what is nearer than `squared`.
void TriangleTree::descend(const Vec3& p, std::uint32_t from, double& squared, const Corners*& triangle) const {
  std::pair<double, std::uint32_t> stack[kDeepest];
  int depth = 0;
  stack[depth++] = {squared_distance(p, nodes_[from].box), from};
  while (depth > 0) {
    const auto [nearest, n] = stack[--depth];
    if (nearest >= squared) continue;
    const Node& node = nodes_[n];
    if (node.count > 0) {
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        const Corners& t = triangles_[i];
        const double d = squared_distance_to_triangle(p, t.a, t.b, t.c);
        if (d >= squared) continue;
        squared = d;
        triangle = &t;
      }
      continue;
    }
    std::pair<double, std::uint32_t> near{squared_distance(p, nodes_[n + 1].box), n + 1};
    std::pair<double, std::uint32_t> far{squared_distance(p, nodes_[node.first].box), node.first};
    if (far.first < near.first) std::swap(near, far);
    stack[depth++] = far;
    stack[depth++] = near;
  }
}

TriangleTree::Nearby::Nearby(const TriangleTree& tree, const Vec3& center, double radius, double bound)
    : tree_(tree), bound_(bound) {
  constexpr double kRounding = 1 + 1e-9;
  const Hit hit = tree.search(center, (bound + radius) * kRounding);
  if (!hit.triangle) return;
  last_ = hit.triangle;
  // No point of the ball is farther from its nearest triangle than this, nor is that triangle from the center than `reach`.
  const double reach = (std::min(bound, hit.distance + radius) + radius) * kRounding;
  std::vector<std::uint32_t> open = {0};
  while (!open.empty()) {
    const std::uint32_t n = open.back();
    open.pop_back();
    const Node& node = tree.nodes_[n];
    if (squared_distance(center, node.box) > reach * reach) continue;
    if (node.count > 0 || node.box.size().maxCoeff() <= radius) {
      roots_.push_back(n);
    } else {
      open.push_back(node.first);
      open.push_back(n + 1);
    }
  }
}

double TriangleTree::Nearby::distance(const Vec3& p) {
  double best = bound_ * bound_;
  const Corners* triangle = nullptr;
  const auto look = [&](const Corners& t) {
    const double d = squared_distance_to_triangle(p, t.a, t.b, t.c);
    if (d >= best) return;
    best = d;
    triangle = &t;
  };
  if (last_ != nullptr) look(*last_);
  for (const std::uint32_t n : roots_)
    if (squared_distance(p, tree_.nodes_[n].box) < best) tree_.descend(p, n, best, triangle);
  if (triangle == nullptr) return bound_;
  last_ = triangle;
  return std::sqrt(best);
}

}  // namespace meniscus::band
