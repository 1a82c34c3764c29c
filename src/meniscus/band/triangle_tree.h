#pragma once

#include <meniscus/base/box.h>
#include <meniscus/mesh/mesh.h>

#include <cstdint>
#include <vector>

namespace meniscus::band {

/// Finds the distance to a mesh's triangles: a tree of boxes. Building O(n log n), about 110 bytes a triangle; a question
/// O(log n) near the surface. Safe to ask from many threads. Vertices must be finite, indices in range.
class TriangleTree {
 public:
  explicit TriangleTree(const mesh::Mesh& mesh);

  /// Distance from `p` to the nearest triangle, or `bound` if that is less. A small bound makes the search short.
  double distance(const Vec3& p, double bound) const { return search(p, bound).distance; }

  /// The unit normal of the triangle nearest to `p`, turned to the side of its plane that p lies on. Zero when no triangle
  /// is nearer than `bound`, when the nearest has no area, or for a point in its plane.
  Vec3 normal_towards(const Vec3& p, double bound) const;

  class Nearby;

 private:
  struct Node {
    Box box;
    std::uint32_t first;  // triangle of a leaf; of an inner node the right child, the left one comes next
    std::uint32_t count;  // 0 for an inner node
  };
  struct Corners {
    Vec3 a, b, c;
  };
  struct Hit {
    double distance;
    const Corners* triangle;  // null when nothing is nearer than the bound
  };
  Hit search(const Vec3& p, double bound) const;
  void descend(const Vec3& p, std::uint32_t from, double& squared, const Corners*& triangle) const;
  std::uint32_t build(std::vector<Corners>& all, std::uint32_t begin, std::uint32_t end);

  std::vector<Node> nodes_;
  std::vector<Corners> triangles_;
};

/// The part of a tree that questions from within a ball can need: found once, it makes many questions from there short.
/// Not safe to ask from several threads. The tree must outlive it.
class TriangleTree::Nearby {
 public:
  /// For points within `radius` of `center` and distances up to `bound`.
  Nearby(const TriangleTree& tree, const Vec3& center, double radius, double bound);

  /// No triangle is nearer than the bound to any point of the ball.
  bool empty() const { return roots_.empty(); }
  /// As TriangleTree::distance(p, bound), to the last bit. Neighbouring points asked one after the other are quickest: the
  /// triangle found last is tried first.
  double distance(const Vec3& p);

 private:
  const TriangleTree& tree_;
  double bound_;
  std::vector<std::uint32_t> roots_;  // of subtrees, small against the ball
  const Corners* last_ = nullptr;
};

}  // namespace meniscus::band
