#include <meniscus/band/components.h>
#include <meniscus/band/kernels.h>
#include <meniscus/base/disjoint_sets.h>
#include <meniscus/base/parallel.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>

namespace meniscus::band {
namespace {

/// Vector area and flux of x (three times the volume share) of one component within a brick.
struct Share {
  std::int32_t label;
  double area = 0, flux = 0;
};

struct Corner {
  Vec3 x;
  double f;
  std::int32_t label;
};

void add_triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& outwards, Share& share) {
  Vec3 n = 0.5 * (b - a).cross(c - a);
  if (n.dot(outwards) < 0) n = -n;
  share.area += n.norm();
  share.flux += a.dot(n);
}

/// The linear surface within a tetrahedron: a triangle or a quadrilateral.
void add_tetrahedron(const std::array<Corner, 4>& t, Share& share) {
  std::array<std::size_t, 4> in{}, out{};
  std::size_t ins = 0, outs = 0;
  for (std::size_t i = 0; i < 4; ++i) (t[i].f < 0 ? in[ins++] : out[outs++]) = i;
  if (ins == 0 || outs == 0) return;
  const auto cut = [&](std::size_t a, std::size_t b) {
    return Vec3(t[a].x + (t[a].f / (t[a].f - t[b].f)) * (t[b].x - t[a].x));
  };
  Vec3 outwards = Vec3::Zero();
  for (std::size_t i = 0; i < outs; ++i) outwards += t[out[i]].x / static_cast<double>(outs);
  for (std::size_t i = 0; i < ins; ++i) outwards -= t[in[i]].x / static_cast<double>(ins);
  if (ins == 2) {
    const Vec3 a = cut(in[0], out[0]), b = cut(in[0], out[1]), c = cut(in[1], out[1]), d = cut(in[1], out[0]);
    add_triangle(a, b, c, outwards, share);
    add_triangle(a, c, d, outwards, share);
  } else if (ins == 1) {
    add_triangle(cut(in[0], out[0]), cut(in[0], out[1]), cut(in[0], out[2]), outwards, share);
  } else {
    add_triangle(cut(in[0], out[0]), cut(in[1], out[0]), cut(in[2], out[0]), outwards, share);
  }
}

Share& share_of(std::vector<Share>& shares, std::int32_t label) {
  for (Share& s : shares)
    if (s.label == label) return s;
  shares.push_back({label});
  return shares.back();
}

/// The six tetrahedra around a cell's diagonal, as paths of corner numbers (bits x, y, z) from 0 to 7.
constexpr std::array<std::array<std::size_t, 2>, 6> kPaths = {{{1, 3}, {1, 5}, {2, 3}, {2, 6}, {4, 5}, {4, 6}}};

void add_cell(const std::array<Corner, 8>& corner, std::vector<Share>& shares) {
  for (const auto& path : kPaths) {
    const std::array<Corner, 4> t = {corner[0], corner[path[0]], corner[path[1]], corner[7]};
    const auto inside = std::find_if(t.begin(), t.end(), [](const Corner& c) { return c.f < 0; });
    if (inside != t.end()) add_tetrahedron(t, share_of(shares, inside->label));
  }
}

}  // namespace

Labels label_components(const Band& band) {
  const std::span<const float> f = band.values();
  const float b = band.background();
  const auto counts = [&](std::size_t n) { return f[n] < 0 && f[n] > -b; };
  DisjointSets sets(f.size());
  for (std::size_t brick = 0; brick < band.brick_count(); ++brick) {
    const std::size_t base = brick * Band::kBrickNodes;
    const Band::Neighbours& nb = band.neighbours(brick);
    for (std::size_t n = 0; n < Band::kBrickNodes; ++n) {
      if (!counts(base + n)) continue;
      const auto join = [&](std::size_t place, std::size_t stride, std::size_t d) {
        std::size_t m = base + n + stride;
        if (place == 7) {
          if (nb[d] < 0) return;
          m = static_cast<std::size_t>(nb[d]) * Band::kBrickNodes + n - 7 * stride;
        }
        if (counts(m)) sets.join(static_cast<std::uint32_t>(base + n), static_cast<std::uint32_t>(m));
      };
      join(n >> 6, 64, Band::direction(1, 0, 0));
      join(n >> 3 & 7, 8, Band::direction(0, 1, 0));
      join(n & 7, 1, Band::direction(0, 0, 1));
    }
  }
  Labels out;
  out.node.assign(f.size(), -1);
  // A root is the smallest number of its set: it is met first.
  for (std::size_t n = 0; n < f.size(); ++n)
    if (counts(n)) {
      const std::uint32_t r = sets.root(static_cast<std::uint32_t>(n));
      out.node[n] = r == n ? static_cast<std::int32_t>(out.count++) : out.node[r];
    }
  return out;
}

std::vector<Component> measure_components(const Band& band, const Labels& labels, const RunControl& run) {
  const float b = band.background();
  std::vector<std::vector<Share>> shares(band.brick_count());
  // Coordinates in voxels about a middle brick: far from the origin the flux would cancel badly.
  const Coord middle = band.empty() ? Coord{} : band.bricks()[band.brick_count() / 2];
  parallel_for(band.brick_count(), 16, run, [&](std::size_t brick) {
    Halo halo;
    gather_halo(band, band.values().data(), brick, b, -b, halo);
    if (!holds_surface(halo)) return;
    const Coord& c = band.bricks()[brick];
    const Vec3 corner0(8.0 * (c[0] - middle[0]), 8.0 * (c[1] - middle[1]), 8.0 * (c[2] - middle[2]));
    const auto label_at = [&](int i, int j, int k) {
      const std::int32_t n = i < 8 && j < 8 && k < 8 ? static_cast<std::int32_t>(brick)
                                                     : band.neighbours(brick)[Band::direction(i > 7, j > 7, k > 7)];
      if (n < 0) return std::int32_t{-1};
      return labels.node[static_cast<std::size_t>(n) * Band::kBrickNodes +
                         static_cast<std::size_t>(((i & 7) * 8 + (j & 7)) * 8 + (k & 7))];
    };
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < 8; ++j)
        for (int k = 0; k < 8; ++k) {
          const float* p = halo + halo_at(i, j, k);
          int inside = 0;
          for (int q = 0; q < 8; ++q) inside += p[(q & 1) * kHaloX + (q >> 1 & 1) * kHaloY + (q >> 2)] < 0;
          if (inside == 0 || inside == 8) continue;
          std::array<Corner, 8> corner;
          for (int q = 0; q < 8; ++q) {
            const int x = q & 1, y = q >> 1 & 1, z = q >> 2;
            const float f = p[x * kHaloX + y * kHaloY + z];
            corner[static_cast<std::size_t>(q)] = {corner0 + Vec3(i + x, j + y, k + z), static_cast<double>(f),
                                                   f < 0 ? label_at(i + x, j + y, k + z) : -1};
          }
          add_cell(corner, shares[brick]);
        }
  });
  std::vector<Component> out(labels.count);
  const double h = band.voxel();
  for (const auto& list : shares)
    for (const Share& s : list)
      if (s.label >= 0) {
        out[static_cast<std::size_t>(s.label)].area += s.area * h * h;
        out[static_cast<std::size_t>(s.label)].volume += s.flux * h * h * h / 3;
      }
  return out;
}

void inherit_goals(const Labels& before, const std::vector<Component>& old, const Labels& now,
                   std::vector<Component>& fresh) {
  // Old and new components that share a node stand and fall together: sets over old numbers, then new ones.
  DisjointSets sets(old.size() + fresh.size());
  for (std::size_t n = 0; n < now.node.size(); ++n)
    if (now.node[n] >= 0 && before.node[n] >= 0)
      sets.join(static_cast<std::uint32_t>(before.node[n]),
                static_cast<std::uint32_t>(old.size() + static_cast<std::size_t>(now.node[n])));

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
