#include <meniscus/base/parallel.h>
#include <meniscus/sample/projection.h>
#include <meniscus/sample/seeds.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace meniscus::sample {
namespace {

constexpr int kRootCells = 4;   // along the longest side
constexpr int kBisections = 6;  // Newton does the rest
constexpr std::size_t kProbes = 9;

using Cell = std::array<std::int32_t, 3>;

/// A lattice of cubes over the box: 2^level times finer than its roots.
struct Lattice {
  Vec3 origin;
  double size;

  Vec3 corner(const Cell& c, double dx, double dy, double dz) const {
    return origin + size * Vec3(c[0] + dx, c[1] + dy, c[2] + dz);
  }
  Box box(const Cell& c) const { return {corner(c, 0, 0, 0), corner(c, 1, 1, 1)}; }
};

std::vector<Cell> root_cells(const Box& box, double size) {
  std::vector<Cell> cells;
  Cell n;
  for (int a = 0; a < 3; ++a)
    n[static_cast<std::size_t>(a)] = std::max(1, static_cast<int>(std::ceil(box.size()[a] / size - 1e-9)));
  for (std::int32_t x = 0; x < n[0]; ++x)
    for (std::int32_t y = 0; y < n[1]; ++y)
      for (std::int32_t z = 0; z < n[2]; ++z) cells.push_back({x, y, z});
  return cells;
}

/// The children of `cells` inside the box.
std::vector<Cell> halved(const std::vector<Cell>& cells, const Lattice& lattice, const Box& box) {
  std::vector<Cell> out;
  out.reserve(8 * cells.size());
  for (const Cell& c : cells)
    for (std::int32_t k = 0; k < 8; ++k) {
      const Cell child = {2 * c[0] + (k & 1), 2 * c[1] + (k >> 1 & 1), 2 * c[2] + (k >> 2)};
      if ((lattice.corner(child, 0, 0, 0).array() <= box.max.array()).all()) out.push_back(child);
    }
  return out;
}

template <class T>
std::vector<T> kept(const std::vector<T>& items, const std::vector<std::uint8_t>& keep) {
  std::vector<T> out;
  for (std::size_t i = 0; i < items.size(); ++i)
    if (keep[i]) out.push_back(items[i]);
  return out;
}

/// Drops the cells in which F cannot vanish.
std::vector<Cell> pruned(const field::Field& surface, const Lattice& lattice, const std::vector<Cell>& cells,
                         const RunControl& run) {
  std::vector<std::uint8_t> keep(cells.size());
  parallel_for(cells.size(), 64, run, [&](std::size_t i) {
    const field::Interval f = surface.range(lattice.box(cells[i]));
    keep[i] = !(f.lo > 0) && !(f.hi < 0);
  });
  return kept(cells, keep);
}

/// Two points of a cell between which F changes sign.
struct Crossing {
  Vec3 inside, outside;
};

struct Probe {
  std::vector<Crossing> crossings;
  std::vector<Cell> quiet;  // cells without a change of sign
  std::size_t not_finite = 0;
};

Probe probed(const field::Field& surface, const Lattice& lattice, const Box& box, const std::vector<Cell>& cells,
             const RunControl& run) {
  std::vector<Vec3> points(kProbes * cells.size());
  for (std::size_t c = 0; c < cells.size(); ++c)
    for (std::size_t k = 0; k < kProbes; ++k) {
      const double d = k == 8 ? 0.5 : 0;
      const Vec3 p =
          lattice.corner(cells[c], d + (k < 8 ? k & 1 : 0), d + (k < 8 ? k >> 1 & 1 : 0), d + (k < 8 ? k >> 2 : 0));
      points[kProbes * c + k] = p.cwiseMin(box.max);
    }
  const field::JetBatch f = field::evaluate(surface, points, field::Order::Value, run);
  Probe out;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const Vec3 *inside = nullptr, *outside = nullptr;
    for (std::size_t k = kProbes * c; k < kProbes * (c + 1); ++k) {
      if (!std::isfinite(f.value(k))) {
        ++out.not_finite;
        continue;
      }
      (f.value(k) < 0 ? inside : outside) = &points[k];
    }
    if (inside && outside)
      out.crossings.push_back({*inside, *outside});
    else
      out.quiet.push_back(cells[c]);
  }
  return out;
}

/// Halves every crossing a few times and takes its middle.
SurfacePoints bisected(const field::Field& surface, std::vector<Crossing> crossings, const RunControl& run) {
  std::vector<Vec3> middle(crossings.size());
  for (int round = 0; round <= kBisections; ++round) {
    for (std::size_t i = 0; i < crossings.size(); ++i) middle[i] = 0.5 * (crossings[i].inside + crossings[i].outside);
    if (round == kBisections) break;
    const field::JetBatch f = field::evaluate(surface, middle, field::Order::Value, run);
    for (std::size_t i = 0; i < crossings.size(); ++i)
      (f.value(i) < 0 ? crossings[i].inside : crossings[i].outside) = middle[i];
  }
  SurfacePoints points;
  points.resize(middle.size());
  for (std::size_t i = 0; i < middle.size(); ++i) points.set_position(i, middle[i]);
  return points;
}

/// Projects the crossings of one level and appends those that arrive.
void append_seeds(const field::Field& surface, const Box& box, const Lattice& lattice, double tolerance,
                  const std::vector<Crossing>& crossings, Seeds& seeds, const RunControl& run) {
  SurfacePoints points = bisected(surface, crossings, run);
  const std::vector<std::uint8_t> arrived =
      project(surface, box, {.tolerance = tolerance, .max_distance = lattice.size}, points, run);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (arrived[i]) seeds.points.push_back(points.position(i), points.normal(i));
}

}  // namespace

Seeds find_seeds(const field::Field& surface, const Box& box, const SeedOptions& options, const RunControl& run) {
  Seeds seeds;
  Lattice lattice{box.min, std::max(box.size().maxCoeff() / kRootCells, options.resolution)};
  std::vector<Cell> cells = pruned(surface, lattice, root_cells(box, lattice.size), run);
  const auto halve = [&] {
    lattice.size *= 0.5;
    cells = pruned(surface, lattice, halved(cells, lattice, box), run);
  };
  while (lattice.size > options.resolution && 4 * cells.size() < options.max_cells) halve();
  for (int level = 0;; ++level) {
    Probe probe = probed(surface, lattice, box, cells, run);
    append_seeds(surface, box, lattice, options.tolerance, probe.crossings, seeds, run);
    seeds.not_finite += probe.not_finite;
    cells = std::move(probe.quiet);
    if (level == options.refinements || cells.empty() || 8 * cells.size() > options.max_cells) break;
    halve();
  }
  seeds.unresolved = cells.size();
  return seeds;
}

}  // namespace meniscus::sample
