#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>
#include <meniscus/polygonize/bricks_near.h>

#include <algorithm>

namespace meniscus::polygonize {
namespace {

constexpr std::size_t kNodesPerBlock = 16;
constexpr std::size_t kCellsPerBrick = std::size_t{kBrickCells} * kBrickCells * kBrickCells;

/// The octree: node n of level l covers bricks [n·2^l, (n+1)·2^l) per axis, so its planes do not depend on the lattice's
/// rim.
class Octree {
 public:
  Octree(const ClippedField& field, const Lattice& lattice) : field_(field), lattice_(lattice) {
    for (std::size_t a = 0; a < 3; ++a) {
      first_[a] = lattice.low[a] >> 3;
      last_[a] = (lattice.high[a] - 1) >> 3;
    }
  }

  /// The coarsest useful level: at most two nodes an axis.
  int top() const {
    int level = 0;
    const auto spans = [&](std::size_t a) { return (last_[a] >> level) - (first_[a] >> level); };
    while (std::max({spans(0), spans(1), spans(2)}) > 1) ++level;
    return level;
  }

  std::vector<Coord> nodes(int level) const {
    std::vector<Coord> all;
    for (std::int32_t x = first_[0] >> level; x <= last_[0] >> level; ++x)
      for (std::int32_t y = first_[1] >> level; y <= last_[1] >> level; ++y)
        for (std::int32_t z = first_[2] >> level; z <= last_[2] >> level; ++z) all.push_back({x, y, z});
    return all;
  }

  bool may_hold_surface(const Coord& node, int level) const {
    Coord low{};
    Coord high{};
    for (std::size_t a = 0; a < 3; ++a) {
      const std::int64_t begin = std::int64_t{node[a]} << level;
      const std::int64_t end = begin + (std::int64_t{1} << level);
      if (end <= first_[a] || begin > last_[a]) return false;
      low[a] = static_cast<std::int32_t>(std::max<std::int64_t>(begin * kBrickCells, lattice_.low[a]));
      high[a] = static_cast<std::int32_t>(std::min<std::int64_t>(end * kBrickCells, lattice_.high[a]));
    }
    const field::Interval range = field_.range({lattice_.point(low), lattice_.point(high)});
    return !(range.lo >= 0) && !(range.hi < 0);
  }

 private:
  const ClippedField& field_;
  const Lattice& lattice_;
  Coord first_{};
  Coord last_{};
};

/// The nodes among `nodes` that may hold the surface, in their order.
std::vector<Coord> sieve(const Octree& tree, const std::vector<Coord>& nodes, int level, const RunControl& run) {
  std::vector<char> keep(nodes.size());
  parallel_for(nodes.size(), kNodesPerBlock, run,
               [&](std::size_t n) { keep[n] = tree.may_hold_surface(nodes[n], level) ? 1 : 0; });
  std::vector<Coord> kept;
  for (std::size_t n = 0; n < nodes.size(); ++n)
    if (keep[n] != 0) kept.push_back(nodes[n]);
  return kept;
}

std::vector<Coord> children(const std::vector<Coord>& nodes) {
  std::vector<Coord> result;
  result.reserve(8 * nodes.size());
  for (const Coord& n : nodes)
    for (int c = 0; c < 8; ++c) result.push_back({2 * n[0] + (c >> 2), 2 * n[1] + ((c >> 1) & 1), 2 * n[2] + (c & 1)});
  return result;
}

}  // namespace

BricksNear bricks_near(const ClippedField& field, const Lattice& lattice, std::size_t max_cells, const RunControl& run) {
  const Octree tree(field, lattice);
  BricksNear result;
  int level = tree.top();
  std::vector<Coord> nodes = tree.nodes(level);
  while (true) {
    result.boxes_tested += nodes.size();
    nodes = sieve(tree, nodes, level, run);
    if (level == 0) break;
    // Every node that is kept has at least one child that is.
    if (nodes.size() > max_cells / kCellsPerBrick)
      throw ResourceLimit("polygonize: at least " + std::to_string(nodes.size() * kCellsPerBrick) +
                          " cells would be sampled, more than the allowed " + std::to_string(max_cells) +
                          "; use a larger voxel or a smaller box");
    nodes = children(nodes);
    --level;
  }
  result.bricks = std::move(nodes);
  return result;
}

}  // namespace meniscus::polygonize
