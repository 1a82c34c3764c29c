#include <meniscus/band/crossings.h>
#include <meniscus/band/kernels.h>
#include <meniscus/base/parallel.h>

#include <cmath>
#include <limits>

namespace meniscus::band {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
constexpr int kStrides[3] = {kHaloX, kHaloY, 1};
constexpr int kExtendPasses = 6;  // steps along axes that reach the band's rim in any direction

/// Calls work(node, place in the halo, axis) for every crossed edge that starts in the brick.
template <class Work>
void for_crossed_edges(const float* halo, const Work& work) {
  for (int eighth = 0; eighth < 8; ++eighth) {
    const int oi = (eighth >> 2 & 1) * 4, oj = (eighth >> 1 & 1) * 4, ok = (eighth & 1) * 4;
    for (int i = oi; i < oi + 4; ++i)
      for (int j = oj; j < oj + 4; ++j)
        for (int k = ok; k < ok + 4; ++k) {
          const int h = halo_at(i, j, k);
          for (int axis = 0; axis < 3; ++axis)
            if ((halo[h] < 0) != (halo[h + kStrides[axis]] < 0)) work(Coord{i, j, k}, h, axis);
        }
  }
}

Vec3 gradient(const float* p) {
  return {static_cast<double>(p[kHaloX] - p[-kHaloX]), static_cast<double>(p[kHaloY] - p[-kHaloY]),
          static_cast<double>(p[1] - p[-1])};
}

/// The node one step along an axis, in this brick or the next; -1 beyond the bricks.
std::int64_t next_node(const Band& band, std::size_t brick, Coord node, int axis) {
  if (++node[static_cast<std::size_t>(axis)] == 8) {
    node[static_cast<std::size_t>(axis)] = 0;
    const std::int32_t n = band.neighbours(brick)[Band::direction(axis == 0, axis == 1, axis == 2)];
    if (n < 0) return -1;
    brick = static_cast<std::size_t>(n);
  }
  return static_cast<std::int64_t>(brick * Band::kBrickNodes) + (node[0] * 8 + node[1]) * 8 + node[2];
}

}  // namespace

Crossings find_crossings(const Band& band, const RunControl& run) {
  const float b = band.background();
  Crossings out;
  out.brick_begin.assign(band.brick_count() + 1, 0);
  const auto with_halo = [&](const auto& work) {
    parallel_for(band.brick_count(), 16, run, [&](std::size_t brick) {
      float halo[kHaloSize];
      gather_halo(band, band.values().data(), brick, b, -b, halo);
      if (holds_surface(halo)) work(brick, halo);
    });
  };
  with_halo([&](std::size_t brick, const float* halo) {
    std::size_t count = 0;
    for_crossed_edges(halo, [&](const Coord& node, int, int axis) { count += next_node(band, brick, node, axis) >= 0; });
    out.brick_begin[brick + 1] = count;
  });
  for (std::size_t i = 0; i < band.brick_count(); ++i) out.brick_begin[i + 1] += out.brick_begin[i];
  const std::size_t total = out.brick_begin.back();
  out.x = field::PositionBatch(total);
  out.normal.resize(total);
  out.inside.resize(total);
  out.outside.resize(total);

  with_halo([&](std::size_t brick, const float* halo) {
    std::size_t at = out.brick_begin[brick];
    for_crossed_edges(halo, [&](const Coord& node, int h, int axis) {
      const std::int64_t other = next_node(band, brick, node, axis);
      if (other < 0) return;
      const auto own = static_cast<std::uint32_t>(brick * Band::kBrickNodes) +
                       static_cast<std::uint32_t>((node[0] * 8 + node[1]) * 8 + node[2]);
      const float here = halo[h], there = halo[h + kStrides[axis]];
      const double t = static_cast<double>(here) / (static_cast<double>(here) - static_cast<double>(there));
      Vec3 p = band.position(brick, node[0], node[1], node[2]);
      p[axis] += t * band.voxel();
      const Vec3 g = (1 - t) * gradient(halo + h) + t * gradient(halo + h + kStrides[axis]);
      const double length = g.norm();
      out.x.set(at, p);
      out.normal[at] = length > 0 ? Vec3(g / length) : Vec3(Vec3::Zero());
      out.inside[at] = here < 0 ? own : static_cast<std::uint32_t>(other);
      out.outside[at] = here < 0 ? static_cast<std::uint32_t>(other) : own;
      ++at;
    });
  });
  return out;
}

std::vector<float> node_speeds(const Band& band, const Crossings& crossings, std::span<const double> speed,
                               const RunControl& run) {
  std::vector<float> sum(band.values().size(), 0.0f), next(sum.size());
  std::vector<std::uint8_t> count(sum.size(), 0);
  for (std::size_t c = 0; c < crossings.size(); ++c)
    for (const std::uint32_t node : {crossings.inside[c], crossings.outside[c]}) {
      sum[node] += static_cast<float>(speed[c]);
      ++count[node];
    }
  parallel_for(sum.size(), 4096, run, [&](std::size_t n) { sum[n] = count[n] > 0 ? sum[n] / count[n] : kNone; });

  const float b = band.background();
  const Kernels& kernel = kernels();
  for (int pass = 0; pass < kExtendPasses; ++pass) {
    parallel_for(band.brick_count(), 16, run, [&](std::size_t brick) {
      float phi[kHaloSize], v[kHaloSize];
      gather_halo(band, band.values().data(), brick, b, -b, phi);
      gather_halo(band, sum.data(), brick, kNone, kNone, v);
      kernel.extend(phi, v, next.data() + brick * Band::kBrickNodes);
    });
    sum.swap(next);
  }
  parallel_for(sum.size(), 4096, run, [&](std::size_t n) { sum[n] = std::isnan(sum[n]) ? 0.0f : sum[n]; });
  return sum;
}

}  // namespace meniscus::band
