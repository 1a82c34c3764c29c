#include <meniscus/band/crossings.h>
#include <meniscus/band/kernels.h>
#include <meniscus/base/parallel.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

namespace meniscus::band {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
constexpr int kStrides[3] = {kHaloX, kHaloY, 1};
constexpr double kUnit[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

using EdgeList = std::array<std::uint16_t, 3 * Band::kBrickNodes>;

/// std::popcount() is a call where a processor may lack the instruction.
std::size_t bit_count(std::uint64_t bits) {
  bits -= bits >> 1 & 0x5555555555555555;
  bits = (bits & 0x3333333333333333) + (bits >> 2 & 0x3333333333333333);
  return static_cast<std::size_t>(((bits + (bits >> 4)) & 0x0F0F0F0F0F0F0F0F) * 0x0101010101010101 >> 56);
}

/// The nodes from which the surface crosses the edge to the next node, per axis; edges into bricks that are not there are
/// left out.
struct CrossedEdges {
  static constexpr std::uint64_t kColumn = 0x0101010101010101;
  NodeBits axis[3];

  CrossedEdges(const Band& band, const Outlines& outlines, std::size_t brick) {
    const NodeBits& own = outlines[brick].inside;
    const Band::Neighbours& nb = band.neighbours(brick);
    const auto next = [&](int dx, int dy, int dz) {
      const std::int32_t n = nb[Band::direction(dx, dy, dz)];
      return n < 0 ? nullptr : &outlines[static_cast<std::size_t>(n)].inside;
    };
    const NodeBits *x = next(1, 0, 0), *y = next(0, 1, 0), *z = next(0, 0, 1);
    constexpr std::uint64_t kLastColumn = kColumn << 7, kLastRow = std::uint64_t{0xFF} << 56;
    for (std::size_t i = 0; i < 8; ++i) {
      const std::uint64_t s = own[i];
      axis[0][i] = s ^ (i < 7 ? own[i + 1] : x != nullptr ? (*x)[0] : s);
      axis[1][i] = s ^ (s >> 8 | (y != nullptr ? (*y)[i] << 56 : s & kLastRow));
      axis[2][i] = s ^ ((s >> 1 & ~kLastColumn) | ((z != nullptr ? (*z)[i] << 7 : s) & kLastColumn));
    }
  }

  std::size_t count() const {
    std::size_t n = 0;
    for (const NodeBits& a : axis)
      for (const std::uint64_t plane : a) n += bit_count(plane);
    return n;
  }

  /// Those along one axis that lead into the next brick, as bits in any order.
  std::uint64_t leaving(std::size_t a) const {
    if (a == 0) return axis[0][7];
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < 8; ++i) bits |= a == 1 ? axis[1][i] >> 56 << (8 * i) : (axis[2][i] >> 7 & kColumn) << i;
    return bits;
  }

  /// Lists them, 4 (64 i + 8 j + k) + axis each, by eighths of the brick. Returns how many there are.
  std::size_t list(EdgeList& edges) const {
    std::size_t count = 0;
    for (int eighth = 0; eighth < 8; ++eighth) {
      const std::size_t first = eighth >> 2 & 1 ? 4 : 0;
      const std::uint64_t part = (eighth & 1 ? std::uint64_t{0xF0F0F0F0} : std::uint64_t{0x0F0F0F0F})
                                 << (eighth & 2 ? 32 : 0);
      for (std::size_t i = first; i < first + 4; ++i)
        for (std::uint64_t any = (axis[0][i] | axis[1][i] | axis[2][i]) & part; any != 0; any &= any - 1) {
          const auto bit = static_cast<std::size_t>(std::countr_zero(any));
          for (std::size_t a = 0; a < 3; ++a) {  // written in any case: a branch would be guessed wrong too often
            edges[count] = static_cast<std::uint16_t>(4 * (64 * i + bit) + a);
            count += axis[a][i] >> bit & 1;
          }
        }
    }
    return count;
  }
};

Vec3 gradient(const float* p) {
  return {static_cast<double>(p[kHaloX] - p[-kHaloX]), static_cast<double>(p[kHaloY] - p[-kHaloY]),
          static_cast<double>(p[1] - p[-1])};
}

/// The nodes one step along an axis from those of a brick, in this brick or the next.
struct NextNodes {
  std::uint32_t own[3], next[3];  // what to add to a node's number; `next` for the brick's last nodes along the axis

  NextNodes(const Band& band, std::size_t brick) {
    constexpr std::uint32_t kStep[3] = {64, 8, 1};
    for (std::size_t a = 0; a < 3; ++a) {
      const std::int32_t n = band.neighbours(brick)[Band::direction(a == 0, a == 1, a == 2)];
      own[a] = static_cast<std::uint32_t>(brick * Band::kBrickNodes) + kStep[a];
      next[a] = static_cast<std::uint32_t>(n < 0 ? 0 : n) * static_cast<std::uint32_t>(Band::kBrickNodes) - 7 * kStep[a];
    }
  }
  static bool leaves(std::uint32_t node, std::size_t axis) {
    constexpr std::uint32_t kLast[3] = {7 << 6, 7 << 3, 7};
    return (node & kLast[axis]) == kLast[axis];
  }
  std::uint32_t of(std::uint32_t node, std::size_t axis) const {
    return node + (leaves(node, axis) ? next[axis] : own[axis]);
  }
};

/// Writes a brick's share of everything but normals.
void place_crossings(const Band& band, std::size_t brick, std::span<const std::uint16_t> edges, Crossings& out) {
  const float* values = band.values().data();
  const NextNodes next(band, brick);
  const Vec3 first = band.position(brick, 0, 0, 0);
  std::size_t at = out.brick_begin[brick];
  std::size_t leaving[3];
  std::copy_n(out.leaving_begin.begin() + static_cast<std::ptrdiff_t>(3 * brick), 3, leaving);
  for (const std::uint16_t edge : edges) {
    const std::uint32_t node = edge >> 2;
    const std::size_t axis = edge & 3;
    const std::uint32_t own = static_cast<std::uint32_t>(brick * Band::kBrickNodes) + node, other = next.of(node, axis);
    const double here = static_cast<double>(values[own]), t = here / (here - static_cast<double>(values[other]));
    const double* along = kUnit[axis];
    out.x.x[at] = first.x() + band.voxel() * (static_cast<double>(node >> 6) + t * along[0]);
    out.x.y[at] = first.y() + band.voxel() * (static_cast<double>(node >> 3 & 7) + t * along[1]);
    out.x.z[at] = first.z() + band.voxel() * (static_cast<double>(node & 7) + t * along[2]);
    out.inside[at] = here < 0 ? own : other;
    out.outside[at] = here < 0 ? other : own;
    if (NextNodes::leaves(node, axis)) out.leaves[leaving[axis]++] = static_cast<std::uint32_t>(at);
    ++at;
  }
}

/// Normals where the surface crosses some of a brick's edges.
void find_normals(const Band& band, std::size_t brick, std::span<const std::uint16_t> edges, Vec3* out) {
  Halo halo;
  gather_halo(band, band.values().data(), brick, band.background(), -band.background(), halo);
  for (const std::uint16_t edge : edges) {
    const float* p = halo + halo_at(edge >> 8, edge >> 5 & 7, edge >> 2 & 7);
    const float* q = p + kStrides[edge & 3];
    const double here = static_cast<double>(*p), t = here / (here - static_cast<double>(*q));
    const Vec3 g = (1 - t) * gradient(p) + t * gradient(q);
    const double length = g.norm();
    *out++ = length > 0 ? Vec3(g / length) : Vec3(Vec3::Zero());
  }
}

/// Nodes next to the surface get the mean of their crossings, the others NaN. A node's crossings are in its own brick and in
/// the three before it. Returns whether there were any.
bool mean_at_nodes(const Band& band, const Crossings& crossings, std::span<const double> speed, std::size_t brick,
                   float* out) {
  const std::size_t begin = crossings.brick_begin[brick], end = crossings.brick_begin[brick + 1];
  std::span<const std::uint32_t> entering[3];
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int32_t before = band.neighbours(brick)[Band::direction(-(a == 0), -(a == 1), -(a == 2))];
    if (before >= 0) entering[a] = crossings.leaving(static_cast<std::size_t>(before), a);
  }
  if (begin == end && entering[0].empty() && entering[1].empty() && entering[2].empty()) return false;

  float sum[Band::kBrickNodes] = {}, count[Band::kBrickNodes] = {};
  const auto add = [&](std::uint32_t node, std::size_t c) {
    sum[node % Band::kBrickNodes] += static_cast<float>(speed[c]);
    count[node % Band::kBrickNodes] += 1;
  };
  const auto own = [&](std::uint32_t node) { return node / Band::kBrickNodes == brick; };
  for (const auto& list : entering)
    for (const std::uint32_t c : list) add(own(crossings.inside[c]) ? crossings.inside[c] : crossings.outside[c], c);
  for (std::size_t c = begin; c < end; ++c)
    for (const std::uint32_t node : {crossings.inside[c], crossings.outside[c]})
      if (own(node)) add(node, c);
  for (std::size_t n = 0; n < Band::kBrickNodes; ++n) out[n] = sum[n] / count[n];  // 0/0: not a number
  return true;
}

}  // namespace

Crossings find_crossings(const Band& band, const RunControl& run) {
  Crossings out;
  find_crossings(band, true, out, run);
  return out;
}

void find_crossings(const Band& band, bool normals, Crossings& out, const RunControl& run) {
  find_crossings(band, outlines_of(band, run), normals, out, run);
}

void find_crossings(const Band& band, const Outlines& outlines, bool normals, Crossings& out, const RunControl& run) {
  out.brick_begin.assign(band.brick_count() + 1, 0);
  out.leaving_begin.assign(3 * band.brick_count() + 1, 0);
  parallel_for(band.brick_count(), 64, run, [&](std::size_t brick) {
    const CrossedEdges crossed(band, outlines, brick);
    out.brick_begin[brick + 1] = crossed.count();
    for (std::size_t a = 0; a < 3; ++a) out.leaving_begin[3 * brick + a + 1] = bit_count(crossed.leaving(a));
  });
  for (auto* begin : {&out.brick_begin, &out.leaving_begin}) std::partial_sum(begin->begin(), begin->end(), begin->begin());
  const std::size_t total = out.brick_begin.back();
  for (auto* axis : {&out.x.x, &out.x.y, &out.x.z}) axis->resize(total);
  out.normal.resize(normals ? total : 0);
  out.inside.resize(total);
  out.outside.resize(total);
  out.leaves.resize(out.leaving_begin.back());
  parallel_for(band.brick_count(), 16, run, [&](std::size_t brick) {
    if (out.brick_begin[brick] == out.brick_begin[brick + 1]) return;
    EdgeList edges;
    const std::size_t count = CrossedEdges(band, outlines, brick).list(edges);
    place_crossings(band, brick, {edges.data(), count}, out);
    if (normals) find_normals(band, brick, {edges.data(), count}, out.normal.data() + out.brick_begin[brick]);
  });
}

void near_speeds(const Band& band, const Crossings& crossings, std::span<const double> speed, NodeSpeeds& out,
                 const RunControl& run) {
  out.values.resize(band.values().size());
  out.any.resize(band.brick_count());
  parallel_for(band.brick_count(), 16, run, [&](std::size_t brick) {
    out.any[brick] = mean_at_nodes(band, crossings, speed, brick, out.values.data() + brick * Band::kBrickNodes);
  });
}

void extend_speeds(const Band& band, const NodeSpeeds& speeds, std::size_t brick, const Halo& phi, const RowLayers& rows,
                   Halo& out) {
  gather_star(band, speeds.values.data(), brick, kNone, kNone, out, speeds.any.data());
  kernels().extend(phi, out, rows);
}

}  // namespace meniscus::band
