#include <meniscus/band/components.h>
#include <meniscus/band/outline.h>
#include <meniscus/base/disjoint_sets.h>
#include <meniscus/base/parallel.h>

#include <algorithm>
#include <array>
#include <bit>

namespace meniscus::band {
namespace {

constexpr std::uint64_t kFirstColumn = 0x0101010101010101, kLastColumn = 0x8080808080808080;

/// Nodes of the brick in a direction (each -1, 0 or 1; all 0: the brick itself) that share a cell with one of `nodes`.
NodeBits touched(const NodeBits& nodes, int dx, int dy, int dz) {
  const auto along_rows = [&](std::uint64_t m) {
    if (dz != 0) return dz > 0 ? m >> 7 & kFirstColumn : m << 7 & kLastColumn;
    return m | (m << 1 & ~kFirstColumn) | (m >> 1 & ~kLastColumn);
  };
  const auto across_rows = [&](std::uint64_t m) {
    if (dy != 0) return dy > 0 ? m >> 56 : m << 56;
    return m | m << 8 | m >> 8;
  };
  NodeBits out{};
  if (dx > 0) out[0] = nodes[7];
  if (dx < 0) out[7] = nodes[0];
  for (std::size_t i = 0; dx == 0 && i < 8; ++i) out[i] = nodes[i] | (i > 0 ? nodes[i - 1] : 0) | (i < 7 ? nodes[i + 1] : 0);
  for (std::uint64_t& plane : out)
    if (plane != 0) plane = along_rows(across_rows(plane));
  return out;
}

bool meet(const NodeBits& a, const NodeBits& b) {
  std::uint64_t common = 0;
  for (std::size_t i = 0; i < 8; ++i) common |= a[i] & b[i];
  return common != 0;
}

/// Takes out of `nodes` those that hang together with the first of them.
NodeBits take_piece(NodeBits& nodes) {
  NodeBits piece{};
  const std::size_t i = static_cast<std::size_t>(
      std::find_if(nodes.begin(), nodes.end(), [](std::uint64_t plane) { return plane != 0; }) - nodes.begin());
  piece[i] = nodes[i] & -nodes[i];
  for (NodeBits before{}; before != piece;) {
    before = piece;
    piece = touched(piece, 0, 0, 0);
    for (std::size_t plane = 0; plane < 8; ++plane) piece[plane] &= nodes[plane];
  }
  for (std::size_t plane = 0; plane < 8; ++plane) nodes[plane] &= ~piece[plane];
  return piece;
}

/// Pieces of a brick, not labelled yet.
std::vector<Labels::Piece> pieces_of(const Band& band, std::size_t brick) {
  const float* f = band.values().data() + brick * Band::kBrickNodes;
  Outline outline;
  update_outline(band, f, outline);
  NodeBits left = outline.inside, active;
  kernels().nearer(f, band.background(), active);
  for (std::size_t plane = 0; plane < 8; ++plane) left[plane] &= active[plane];
  std::vector<Labels::Piece> out;
  while (left != NodeBits{}) out.push_back({take_piece(left), -1});
  return out;
}

/// The component of a cell that the surface cuts: that of any inside corner.
std::int32_t label_of_cell(const Band& band, const Labels& labels, std::size_t brick, int cell) {
  for (int q = 0; q < 8; ++q) {
    const int i = (cell >> 6) + (q & 1), j = (cell >> 3 & 7) + (q >> 1 & 1), k = (cell & 7) + (q >> 2);
    const std::int32_t b = band.neighbours(brick)[Band::direction(i >> 3, j >> 3, k >> 3)];
    if (b < 0) continue;
    const std::int32_t label =
        labels.of(static_cast<std::size_t>(b), static_cast<std::size_t>(((i & 7) * 8 + (j & 7)) * 8 + (k & 7)));
    if (label >= 0) return label;
  }
  return -1;
}

/// Area and flux of x (three times the volume) of one component within a brick, in voxels.
struct Share {
  std::int32_t label;
  double area, flux;
};

std::vector<Share> shares_of(const Band& band, const Labels& labels, std::size_t brick, const Vec3& corner) {
  Halo halo;
  gather_halo(band, band.values().data(), brick, band.background(), -band.background(), halo);
  std::array<std::uint16_t, Band::kBrickNodes> cells;
  const std::size_t count = kernels().cut_cells(halo, cells.data());
  std::array<std::int32_t, Band::kBrickNodes> label;
  for (std::size_t c = 0; c < count; ++c) label[c] = label_of_cell(band, labels, brick, cells[c]);
  std::vector<Share> out;
  std::array<std::uint16_t, Band::kBrickNodes> own;
  for (std::size_t c = 0; c < count; ++c) {  // one component after the other; mostly there is but one
    if (label[c] < 0) continue;
    const std::int32_t l = label[c];
    std::size_t owned = 0;
    for (std::size_t d = c; d < count; ++d)
      if (label[d] == l) {
        own[owned++] = cells[d];
        label[d] = -1;
      }
    SurfacePart part;
    kernels().surface_part(halo, static_cast<float>(1 / band.voxel()), own.data(), owned, part);
    const Vec3 normal(part.normal[0], part.normal[1], part.normal[2]);
    out.push_back({l, static_cast<double>(part.area), static_cast<double>(part.flux) + corner.dot(normal)});
  }
  return out;
}

}  // namespace

void Labels::remap(const std::vector<std::int32_t>& map) {
  Labels out;
  out.count = count;
  out.begin.assign(1, 0);
  for (const std::int32_t b : map) {
    if (b >= 0)
      for (std::size_t p = begin[static_cast<std::size_t>(b)]; p < begin[static_cast<std::size_t>(b) + 1]; ++p)
        out.pieces.push_back(pieces[p]);
    out.begin.push_back(out.pieces.size());
  }
  *this = std::move(out);
}

Labels label_components(const Band& band, const RunControl& run) {
  std::vector<std::vector<Labels::Piece>> found(band.brick_count());
  parallel_for(found.size(), 64, run, [&](std::size_t b) { found[b] = pieces_of(band, b); });
  Labels out;
  out.begin.assign(1, 0);
  for (const auto& list : found) {
    out.pieces.insert(out.pieces.end(), list.begin(), list.end());
    out.begin.push_back(out.pieces.size());
  }

  DisjointSets sets(out.pieces.size());
  for (std::size_t b = 0; b < band.brick_count(); ++b)
    for (std::size_t d = 14; d < 27; ++d) {  // the half of the directions that comes after the brick itself
      const std::int32_t n = band.neighbours(b)[d];
      if (n < 0) continue;
      const int x = static_cast<int>(d), dx = x / 9 - 1, dy = x / 3 % 3 - 1, dz = x % 3 - 1;
      for (std::size_t p = out.begin[b]; p < out.begin[b + 1]; ++p) {
        const NodeBits reached = touched(out.pieces[p].nodes, dx, dy, dz);
        for (std::size_t q = out.begin[static_cast<std::size_t>(n)]; q < out.begin[static_cast<std::size_t>(n) + 1]; ++q)
          if (meet(reached, out.pieces[q].nodes)) sets.join(static_cast<std::uint32_t>(p), static_cast<std::uint32_t>(q));
      }
    }
  // A root is the smallest number of its set: it is met first.
  for (std::size_t p = 0; p < out.pieces.size(); ++p) {
    const std::uint32_t root = sets.root(static_cast<std::uint32_t>(p));
    out.pieces[p].label = root == p ? static_cast<std::int32_t>(out.count++) : out.pieces[root].label;
  }
  return out;
}

std::vector<Component> measure_components(const Band& band, const Labels& labels, const RunControl& run) {
  std::vector<std::vector<Share>> shares(band.brick_count());
  // Coordinates in voxels about a middle brick: far from the origin the flux would cancel badly.
  const Coord middle = band.empty() ? Coord{} : band.bricks()[band.brick_count() / 2];
  const std::vector<char> near = surface_bricks(band, outlines_of(band, run), run);
  parallel_for(band.brick_count(), 16, run, [&](std::size_t b) {
    if (near[b] == 0) return;
    const Coord& c = band.bricks()[b];
    shares[b] = shares_of(band, labels, b, 8.0 * Vec3(c[0] - middle[0], c[1] - middle[1], c[2] - middle[2]));
  });
  std::vector<Component> out(labels.count);
  const double h = band.voxel();
  for (const auto& list : shares)
    for (const Share& s : list) {
      out[static_cast<std::size_t>(s.label)].area += s.area * h * h;
      out[static_cast<std::size_t>(s.label)].volume += s.flux * h * h * h / 3;
    }
  return out;
}

void inherit_goals(const Labels& before, const std::vector<Component>& old, const Labels& now,
                   std::vector<Component>& fresh) {
  // Old and new components that share a node stand and fall together: sets over old numbers, then new ones.
  DisjointSets sets(old.size() + fresh.size());
  for (std::size_t b = 0; b + 1 < now.begin.size(); ++b)
    for (std::size_t p = before.begin[b]; p < before.begin[b + 1]; ++p)
      for (std::size_t q = now.begin[b]; q < now.begin[b + 1]; ++q)
        if (meet(before.pieces[p].nodes, now.pieces[q].nodes))
          sets.join(static_cast<std::uint32_t>(before.pieces[p].label),
                    static_cast<std::uint32_t>(old.size() + static_cast<std::size_t>(now.pieces[q].label)));

  struct Group {
    double goal = 0, volume = 0, area = 0;
    bool held = false;
  };
  std::vector<Group> group(old.size() + fresh.size());
  for (std::size_t i = 0; i < old.size(); ++i) {
    Group& g = group[sets.root(static_cast<std::uint32_t>(i))];
    if (old[i].goal) {
      g.goal += *old[i].goal;
      g.held = true;
    } else {
      g.goal += old[i].volume;
    }
  }
  const auto group_of = [&](std::size_t i) -> Group& {
    return group[sets.root(static_cast<std::uint32_t>(old.size() + i))];
  };
  for (std::size_t i = 0; i < fresh.size(); ++i) {
    group_of(i).volume += fresh[i].volume;
    group_of(i).area += fresh[i].area;
  }
  for (std::size_t i = 0; i < fresh.size(); ++i) {
    const Group& g = group_of(i);
    if (g.held) fresh[i].goal = fresh[i].volume + (g.goal - g.volume) * (g.area > 0 ? fresh[i].area / g.area : 1);
  }
}

}  // namespace meniscus::band
