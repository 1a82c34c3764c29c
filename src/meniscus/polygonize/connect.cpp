#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>
#include <meniscus/polygonize/connect.h>

#include <Eigen/Geometry>

#include <algorithm>

namespace meniscus::polygonize {
namespace {

constexpr std::size_t kBricksPerBlock = 16;
/// Quality below which a triangle counts as having no area: its height is some 1e-7 of its longest side.
constexpr double kDegenerate = 1e-14;

/// A polygon around a crossed edge: the vertices of its four cells, and of split faces between them.
struct Polygon {
  std::array<std::uint32_t, 8> vertex;
  int size = 0;
  int first_split = -1;

  void add(std::size_t v) { vertex[static_cast<std::size_t>(size++)] = static_cast<std::uint32_t>(v); }
};

struct BlockResult {
  std::vector<Triangle> triangles;
  std::vector<std::size_t> degenerate;
};

/// A cell found from a brick, perhaps in a neighbour of it.
struct FoundCell {
  const CellCase* kind;
  std::size_t first_vertex;
};

/// The cells of one brick and of its neighbours on the lower sides.
class Neighbourhood {
 public:
  Neighbourhood(const Shell& shell, const SurfaceBrick& brick) : shell_(shell), index_(brick.index) {
    around_.fill(nullptr);
    around_[0] = &brick;
    looked_up_ = 1;
  }

  /// Cell (i, j, k), each from -1 to 7; the surface must pass through it.
  FoundCell cell(int i, int j, int k) {
    const SurfaceBrick& brick = *lower((i < 0 ? 4U : 0U) | (j < 0 ? 2U : 0U) | (k < 0 ? 1U : 0U));
    const SurfaceCell& c = shell_.cells[brick.cell(i & 7, j & 7, k & 7)];
    return {&cases_[c.kind], std::size_t{brick.first_vertex} + c.first_vertex};
  }

 private:
  const SurfaceBrick* lower(unsigned which) {
    if (((looked_up_ >> which) & 1) == 0) {
      around_[which] = shell_.find({index_[0] - static_cast<int>(which >> 2), index_[1] - static_cast<int>((which >> 1) & 1),
                                    index_[2] - static_cast<int>(which & 1)});
      looked_up_ |= 1U << which;
    }
    return around_[which];
  }

  const Shell& shell_;
  const CellCases& cases_ = CellCases::get();
  Coord index_;
  std::array<const SurfaceBrick*, 8> around_;
  unsigned looked_up_ = 0;
};

/// Square of twice the area over the sum of squared sides (1/12 for an equilateral triangle), and the normal.
struct Quality {
  double value;
  Vec3 normal;
};

Quality quality(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 u = b - a;
  const Vec3 v = c - a;
  const Vec3 n = u.cross(v);
  const double sides = u.squaredNorm() + v.squaredNorm() + (v - u).squaredNorm();
  return {sides > 0 ? n.squaredNorm() / (sides * sides) : 0, n};
}

/// The worse of two triangles that share a side, less 1 when they fold over.
double pair_quality(const Quality& p, const Quality& q) {
  const double worse = std::min(p.value, q.value);
  return p.normal.dot(q.normal) < 0 ? worse - 1 : worse;
}

class Connector {
 public:
  Connector(const Shell& shell, BlockResult& out) : shell_(shell), out_(out) {}

  void brick(const SurfaceBrick& brick) {
    Neighbourhood near(shell_, brick);
    for (int i = 0; i < kBrickCells; ++i) {
      std::uint64_t word = brick.mask[static_cast<std::size_t>(i)];
      for (; word != 0; word &= word - 1) {
        const int bit = __builtin_ctzll(word);
        const std::array<int, 3> cell = {i, bit >> 3, bit & 7};
        const std::uint8_t inside = near.cell(cell[0], cell[1], cell[2]).kind->inside;
        for (int axis = 0; axis < 3; ++axis) {
          const bool from = (inside & 1) != 0;
          if (from != (((inside >> corner_bit(axis)) & 1) != 0)) emit(polygon(near, cell, axis), from);
        }
      }
    }
  }

 private:
  /// Around the edge that leaves the cell's lowest corner along `axis`, counter-clockwise seen against the axis.
  Polygon polygon(Neighbourhood& near, const std::array<int, 3>& cell, int axis) {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    // Which way each cell lies from the edge: bit u set = on the lower side along u.
    constexpr std::array<std::array<int, 2>, 4> kAround = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    std::array<FoundCell, 4> cells;
    std::array<int, 4> edge;
    for (std::size_t n = 0; n < 4; ++n) {
      std::array<int, 3> at = cell;
      at[static_cast<std::size_t>(u)] -= kAround[n][0];
      at[static_cast<std::size_t>(v)] -= kAround[n][1];
      cells[n] = near.cell(at[0], at[1], at[2]);
      edge[n] = edge_through(axis, (kAround[n][0] ? corner_bit(u) : 0) | (kAround[n][1] ? corner_bit(v) : 0));
    }
    Polygon result;
    for (std::size_t n = 0; n < 4; ++n) {
      result.add(cells[n].first_vertex + cells[n].kind->loop_of_edge[static_cast<std::size_t>(edge[n])]);
      // The face to the next cell is the upper one of whichever lies lower across it.
      const int across = n % 2 == 0 ? u : v;
      const std::size_t next = (n + 1) % 4;
      const std::size_t owner = kAround[n][across == u ? 0 : 1] != 0 ? n : next;
      add_split(cells[owner], across, edge[owner], result);
    }
    return result;
  }

  static void add_split(const FoundCell& owner, int across, int edge, Polygon& polygon) {
    const CellCase& kind = *owner.kind;
    if (((kind.split >> across) & 1) == 0) return;
    int on_face = 0;
    while (face_edge(2 * across + 1, on_face) != edge) ++on_face;
    const int segment = (kind.upper_segment_of[static_cast<std::size_t>(across)] >> on_face) & 1;
    const int pair = __builtin_popcount(kind.split & ((1U << across) - 1));
    if (polygon.first_split < 0) polygon.first_split = polygon.size;
    polygon.add(owner.first_vertex + kind.loops + static_cast<std::size_t>(2 * pair + segment));
  }

  void emit(const Polygon& p, bool outward) {
    if (p.first_split >= 0) {
      // A fan about a split vertex adds no edge between vertices of cells, so nothing is joined twice.
      for (int n = 1; n + 1 < p.size; ++n) {
        const auto at = [&](int m) { return p.vertex[static_cast<std::size_t>((p.first_split + m) % p.size)]; };
        add(at(0), at(n), at(n + 1), outward);
        if (quality(position(at(0)), position(at(n)), position(at(n + 1))).value < kDegenerate) mark(p);
      }
      return;
    }
    const auto& v = p.vertex;
    const Vec3& a = position(v[0]);
    const Vec3& b = position(v[1]);
    const Vec3& c = position(v[2]);
    const Vec3& d = position(v[3]);
    const double along_ac = pair_quality(quality(a, b, c), quality(a, c, d));
    const double along_bd = pair_quality(quality(a, b, d), quality(b, c, d));
    const unsigned creased = on_crease(v[0]) | on_crease(v[1]) << 1 | on_crease(v[2]) << 2 | on_crease(v[3]) << 3;
    // A crease must not be cut across. The margin keeps ties, frequent by symmetry, from being decided by rounding.
    const bool use_bd = creased == 0b1010 || (creased != 0b0101 && along_bd > along_ac + 1e-6);
    if (use_bd) {
      add(v[0], v[1], v[3], outward);
      add(v[1], v[2], v[3], outward);
    } else {
      add(v[0], v[1], v[2], outward);
      add(v[0], v[2], v[3], outward);
    }
    const double chosen = use_bd ? along_bd : along_ac;
    if ((chosen < 0 ? chosen + 1 : chosen) < kDegenerate) mark(p);
  }

  unsigned on_crease(std::uint32_t v) const { return !shell_.placed.empty() && is_creased(shell_.placed[v]) ? 1U : 0U; }
  const Vec3& position(std::uint32_t v) const { return shell_.positions[v]; }
  void add(std::uint32_t a, std::uint32_t b, std::uint32_t c, bool outward) {
    const auto i = [](std::uint32_t v) { return static_cast<std::int32_t>(v); };
    out_.triangles.push_back(outward ? Triangle{i(a), i(b), i(c)} : Triangle{i(a), i(c), i(b)});
  }
  void mark(const Polygon& p) { out_.degenerate.insert(out_.degenerate.end(), p.vertex.begin(), p.vertex.begin() + p.size); }

  const Shell& shell_;
  BlockResult& out_;
};

}  // namespace

std::vector<std::size_t> without_area(const Shell& shell, const std::vector<Triangle>& triangles) {
  std::vector<std::size_t> vertices;
  for (const Triangle& t : triangles) {
    const auto p = [&](std::size_t k) { return shell.positions[static_cast<std::size_t>(t[k])]; };
    if (quality(p(0), p(1), p(2)).value < kDegenerate)
      for (const std::int32_t v : t) vertices.push_back(static_cast<std::size_t>(v));
  }
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  return vertices;
}

Connection connect(const Shell& shell, std::size_t max_triangles, const RunControl& run) {
  std::vector<BlockResult> results((shell.bricks.size() + kBricksPerBlock - 1) / kBricksPerBlock);
  parallel_blocks(shell.bricks.size(), kBricksPerBlock, run, [&](std::size_t begin, std::size_t end) {
    BlockResult& out = results[begin / kBricksPerBlock];
    std::size_t vertices = 0;
    for (std::size_t b = begin; b < end; ++b) vertices += shell.bricks[b].vertex_count;
    out.triangles.reserve(2 * vertices + vertices / 8);
    Connector connector(shell, out);
    for (std::size_t b = begin; b < end; ++b) connector.brick(shell.bricks[b]);
  });

  std::vector<std::size_t> first(results.size() + 1, 0);
  Connection all;
  for (std::size_t r = 0; r < results.size(); ++r) {
    first[r + 1] = first[r] + results[r].triangles.size();
    all.degenerate.insert(all.degenerate.end(), results[r].degenerate.begin(), results[r].degenerate.end());
  }
  if (first.back() > max_triangles)
    throw ResourceLimit("polygonize: the mesh has " + std::to_string(first.back()) + " triangles, more than the allowed " +
                        std::to_string(max_triangles) + "; use a larger voxel");
  std::sort(all.degenerate.begin(), all.degenerate.end());
  all.degenerate.erase(std::unique(all.degenerate.begin(), all.degenerate.end()), all.degenerate.end());
  all.triangles.resize(first.back());
  parallel_for(results.size(), 1, run, [&](std::size_t r) {
    std::copy(results[r].triangles.begin(), results[r].triangles.end(),
              all.triangles.begin() + static_cast<std::ptrdiff_t>(first[r]));
    results[r] = {};
  });
  return all;
}

}  // namespace meniscus::polygonize
