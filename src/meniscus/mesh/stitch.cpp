#include <meniscus/mesh/adjacency.h>
#include <meniscus/mesh/stitch.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

namespace meniscus::mesh {
namespace {

constexpr double kTurnedOver = 100;         // times the cost
constexpr std::size_t kMost = 100'000'000;  // pairs of vertices

/// Calls visit(from, to) for every side of a triangle that no other triangle shares.
template <class Visit>
void each_boundary_side(const Mesh& mesh, const Visit& visit) {
  for (const Edge& e : edges(mesh)) {
    if (e.uses() != 1) continue;
    if (e.forward == 1)
      visit(e.a, e.b);
    else
      visit(e.b, e.a);
  }
}

/// Two loops side by side, both walked the same way, each beginning at its end of the shortest edge between them.
class Zipper {
 public:
  Zipper(const Mesh& mesh, std::span<const Vec3> normals, Loop one, Loop other)
      : mesh_(mesh), normals_(normals), a_(std::move(one)), b_(std::move(other)) {
    std::reverse(a_.begin(), a_.end());
    double least = std::numeric_limits<double>::infinity();
    std::size_t first_a = 0;
    std::size_t first_b = 0;
    for (std::size_t i = 0; i < a_.size(); ++i)
      for (std::size_t j = 0; j < b_.size(); ++j) {
        const double d = (at(a_[i]) - at(b_[j])).squaredNorm();
        if (d < least) least = d, first_a = i, first_b = j;
      }
    std::rotate(a_.begin(), a_.begin() + static_cast<std::ptrdiff_t>(first_a), a_.end());
    std::rotate(b_.begin(), b_.begin() + static_cast<std::ptrdiff_t>(first_b), b_.end());
  }

  /// Dynamic programming: cost of the best strip that has used i sides of one loop and j of the other.
  std::vector<Triangle> best() const {
    const std::size_t n = a_.size();
    const std::size_t m = b_.size();
    std::vector<std::uint8_t> from_a((n + 1) * (m + 1));
    std::vector<double> cost(m + 1, std::numeric_limits<double>::infinity());
    for (std::size_t i = 0; i <= n; ++i)
      for (std::size_t j = 0; j <= m; ++j) {
        const double down = i > 0 ? cost[j] + price(along_a(i - 1, j)) : std::numeric_limits<double>::infinity();
        const double right = j > 0 ? cost[j - 1] + price(along_b(i, j - 1)) : std::numeric_limits<double>::infinity();
        from_a[i * (m + 1) + j] = down <= right ? 1 : 0;
        cost[j] = i + j == 0 ? 0 : std::min(down, right);
      }
    std::vector<Triangle> strip;
    for (std::size_t i = n, j = m; i + j > 0;) {
      if (from_a[i * (m + 1) + j] != 0)
        strip.push_back(along_a(--i, j));
      else
        strip.push_back(along_b(i, --j));
    }
    std::reverse(strip.begin(), strip.end());
    return strip;
  }

 private:
  const Vec3& at(std::int32_t v) const { return mesh_.positions[static_cast<std::size_t>(v)]; }
  std::int32_t a(std::size_t i) const { return a_[i % a_.size()]; }
  std::int32_t b(std::size_t j) const { return b_[j % b_.size()]; }
  Triangle along_a(std::size_t i, std::size_t j) const { return {a(i), a(i + 1), b(j)}; }
  Triangle along_b(std::size_t i, std::size_t j) const { return {a(i), b(j + 1), b(j)}; }
  double price(const Triangle& t) const {
    const Vec3 u = at(t[1]) - at(t[0]);
    const Vec3 w = at(t[2]) - at(t[0]);
    Vec3 outward = Vec3::Zero();
    for (const std::int32_t v : t) outward += normals_[static_cast<std::size_t>(v)];
    const double squares = u.squaredNorm() + w.squaredNorm() + (u - w).squaredNorm();
    return u.cross(w).dot(outward) > 0 ? squares : kTurnedOver * squares;
  }

  const Mesh& mesh_;
  std::span<const Vec3> normals_;
  Loop a_, b_;
};

}  // namespace

std::vector<std::int32_t> part_touching_loops(Mesh& mesh) {
  std::vector<std::int32_t> left(mesh.triangles.size());
  std::iota(left.begin(), left.end(), 0);
  for (;;) {
    std::vector<std::uint8_t> passes(mesh.positions.size());
    bool touching = false;
    each_boundary_side(mesh, [&](std::int32_t from, std::int32_t) {
      std::uint8_t& p = passes[static_cast<std::size_t>(from)];
      p = p == 0 ? 1 : 2;
      touching = touching || p == 2;
    });
    if (!touching) return left;
    std::size_t kept = 0;
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
      const Triangle t = mesh.triangles[f];
      if (std::any_of(t.begin(), t.end(), [&](std::int32_t v) { return passes[static_cast<std::size_t>(v)] == 2; }))
        continue;
      left[kept] = left[f];
      mesh.triangles[kept++] = t;
    }
    left.resize(kept);
    mesh.triangles.resize(kept);
  }
}

std::vector<Loop> boundary_loops(const Mesh& mesh) {
  constexpr std::int32_t kInside = -1;
  std::vector<std::int32_t> next(mesh.positions.size(), kInside);
  each_boundary_side(mesh, [&](std::int32_t from, std::int32_t to) { next[static_cast<std::size_t>(from)] = to; });
  std::vector<Loop> loops;
  for (std::size_t start = 0; start < next.size(); ++start) {
    if (next[start] == kInside) continue;
    loops.emplace_back();
    for (auto v = static_cast<std::int32_t>(start); v != kInside;) {
      loops.back().push_back(v);
      v = std::exchange(next[static_cast<std::size_t>(v)], kInside);
      if (v == static_cast<std::int32_t>(start)) break;
    }
  }
  return loops;
}

std::optional<std::vector<Triangle>> strip_between(const Mesh& mesh, std::span<const Vec3> normals, const Loop& one,
                                                   const Loop& other) {
  if (one.size() < 3 || other.size() < 3 || one.size() * other.size() > kMost) return std::nullopt;
  return Zipper(mesh, normals, one, other).best();
}

}  // namespace meniscus::mesh
