#include <meniscus/band/crossings.h>
#include <meniscus/band/kernels.h>
#include <meniscus/base/parallel.h>

#include <bit>
#include <cmath>
#include <limits>

namespace meniscus::band {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
constexpr int kStrides[3] = {kHaloX, kHaloY, 1};

/// For every brick, which of its nodes lie inside.
std::vector<NodeBits> inside_bits(const Band& band, const RunControl& run) {
  std::vector<NodeBits> bits(band.brick_count());
  parallel_for(bits.size(), 64, run,
               [&](std::size_t b) { kernels().inside(band.values().data() + b * Band::kBrickNodes, bits[b]); });
  return bits;
}

/// The nodes from which the surface crosses the edge to the next node, per axis; edges into bricks that are not there are
/// left out.
struct CrossedEdges {
  NodeBits axis[3];

  CrossedEdges(const Band& band, const std::vector<NodeBits>& inside, std::size_t brick) {
    const NodeBits& own = inside[brick];
    const Band::Neighbours& nb = band.neighbours(brick);
    const auto next = [&](int dx, int dy, int dz) {
      const std::int32_t n = nb[Band::direction(dx, dy, dz)];
      return n < 0 ? nullptr : &inside[static_cast<std::size_t>(n)];
    };
    const NodeBits *x = next(1, 0, 0), *y = next(0, 1, 0), *z = next(0, 0, 1);
    constexpr std::uint64_t kLastColumn = 0x8080808080808080, kLastRow = std::uint64_t{0xFF} << 56;
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
      for (const std::uint64_t plane : a) n += static_cast<std::size_t>(std::popcount(plane));
    return n;
  }

  /// A bit for each axis along which any of them leads into the next brick.
  std::uint8_t leaves() const {
    std::uint64_t rows = 0, columns = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      rows |= axis[1][i] >> 56;
      columns |= axis[2][i] & 0x8080808080808080;
    }
    return static_cast<std::uint8_t>((axis[0][7] != 0 ? 1 : 0) | (rows != 0 ? 2 : 0) | (columns != 0 ? 4 : 0));
  }

  /// Calls work(i, j, k, axis) for each, by eighths of the brick.
  template <class Work>
  void for_each(const Work& work) const {
    for (int eighth = 0; eighth < 8; ++eighth) {
      const std::size_t first = eighth >> 2 & 1 ? 4 : 0;
      const std::uint64_t part = (eighth & 1 ? std::uint64_t{0xF0F0F0F0} : std::uint64_t{0x0F0F0F0F})
                                 << (eighth & 2 ? 32 : 0);
      for (std::size_t i = first; i < first + 4; ++i)
        for (std::uint64_t any = (axis[0][i] | axis[1][i] | axis[2][i]) & part; any != 0; any &= any - 1) {
          const int bit = std::countr_zero(any);
          for (int a = 0; a < 3; ++a)
            if ((axis[a][i] >> bit & 1) != 0) work(static_cast<int>(i), bit >> 3, bit & 7, a);
        }
    }
  }
};

Vec3 gradient(const float* p) {
  return {static_cast<double>(p[kHaloX] - p[-kHaloX]), static_cast<double>(p[kHaloY] - p[-kHaloY]),
          static_cast<double>(p[1] - p[-1])};
}

/// The node one step along an axis, in this brick or the next.
std::uint32_t next_node(const Band& band, std::size_t brick, Coord node, int axis) {
  if (++node[static_cast<std::size_t>(axis)] == 8) {
    node[static_cast<std::size_t>(axis)] = 0;
    brick = static_cast<std::size_t>(band.neighbours(brick)[Band::direction(axis == 0, axis == 1, axis == 2)]);
  }
  return static_cast<std::uint32_t>(brick * Band::kBrickNodes) +
         static_cast<std::uint32_t>((node[0] * 8 + node[1]) * 8 + node[2]);
}

/// Nodes next to the surface get the mean of their crossings, the others NaN. A node's crossings are in its own brick and in
/// the three before it. Returns whether there were any.
bool mean_at_nodes(const Band& band, const Crossings& crossings, std::span<const double> speed, std::size_t brick,
                   float* out) {
  float sum[Band::kBrickNodes], count[Band::kBrickNodes];
  bool any = false;
  const auto add = [&](std::int32_t from, unsigned through) {
    if (from < 0) return;
    const auto b = static_cast<std::size_t>(from);
    if (b != brick && (crossings.leaves[b] & through) == 0) return;
    const std::size_t begin = crossings.brick_begin[b], end = crossings.brick_begin[b + 1];
    if (begin == end) return;
    if (!any) {
      std::fill(sum, sum + Band::kBrickNodes, 0.0f);
      std::fill(count, count + Band::kBrickNodes, 0.0f);
      any = true;
    }
    for (std::size_t c = begin; c < end; ++c)
      for (const std::uint32_t node : {crossings.inside[c], crossings.outside[c]})
        if (node / Band::kBrickNodes == brick) {
          sum[node % Band::kBrickNodes] += static_cast<float>(speed[c]);
          count[node % Band::kBrickNodes] += 1;
        }
  };
  const Band::Neighbours& nb = band.neighbours(brick);
  add(nb[Band::direction(-1, 0, 0)], 1);
  add(nb[Band::direction(0, -1, 0)], 2);
  add(nb[Band::direction(0, 0, -1)], 4);
  add(static_cast<std::int32_t>(brick), 0);
  for (std::size_t n = 0; any && n < Band::kBrickNodes; ++n) out[n] = sum[n] / count[n];  // 0/0: not a number
  return any;
}

}  // namespace

Crossings find_crossings(const Band& band, const RunControl& run) {
  Crossings out;
  find_crossings(band, true, out, run);
  return out;
}

void find_crossings(const Band& band, bool normals, Crossings& out, const RunControl& run) {
  const std::vector<NodeBits> inside = inside_bits(band, run);
  out.brick_begin.assign(band.brick_count() + 1, 0);
  parallel_for(band.brick_count(), 64, run,
               [&](std::size_t brick) { out.brick_begin[brick + 1] = CrossedEdges(band, inside, brick).count(); });
  for (std::size_t i = 0; i < band.brick_count(); ++i) out.brick_begin[i + 1] += out.brick_begin[i];
  const std::size_t total = out.brick_begin.back();
  for (auto* axis : {&out.x.x, &out.x.y, &out.x.z}) axis->resize(total);
  out.normal.resize(normals ? total : 0);
  out.inside.resize(total);
  out.leaves.assign(band.brick_count(), 0);
  out.outside.resize(total);

  const float b = band.background(), *values = band.values().data();
  parallel_for(band.brick_count(), 16, run, [&](std::size_t brick) {
    std::size_t at = out.brick_begin[brick];
    if (at == out.brick_begin[brick + 1]) return;
    Halo halo;
    if (normals) gather_halo(band, values, brick, b, -b, halo);
    const Vec3 first = band.position(brick, 0, 0, 0);
    const CrossedEdges crossed(band, inside, brick);
    out.leaves[brick] = crossed.leaves();
    crossed.for_each([&](int i, int j, int k, int axis) {
      const auto own =
          static_cast<std::uint32_t>(brick * Band::kBrickNodes) + static_cast<std::uint32_t>((i * 8 + j) * 8 + k);
      const std::uint32_t other = next_node(band, brick, {i, j, k}, axis);
      const double here = static_cast<double>(values[own]), there = static_cast<double>(values[other]);
      const double t = here / (here - there);
      double place[3] = {static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)};
      place[axis] += t;
      out.x.x[at] = first.x() + band.voxel() * place[0];
      out.x.y[at] = first.y() + band.voxel() * place[1];
      out.x.z[at] = first.z() + band.voxel() * place[2];
      out.inside[at] = here < 0 ? own : other;
      out.outside[at] = here < 0 ? other : own;
      if (normals) {
        const float* p = halo + halo_at(i, j, k);
        const Vec3 g = (1 - t) * gradient(p) + t * gradient(p + kStrides[axis]);
        const double length = g.norm();
        out.normal[at] = length > 0 ? Vec3(g / length) : Vec3(Vec3::Zero());
      }
      ++at;
    });
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

void extend_speeds(const Band& band, const NodeSpeeds& speeds, std::size_t brick, const Halo& phi, Halo& out, Rows rows) {
  gather_star(band, speeds.values.data(), brick, kNone, kNone, out, rows, speeds.any.data());
  kernels().extend(phi, out, band.background(), rows);
}

}  // namespace meniscus::band
