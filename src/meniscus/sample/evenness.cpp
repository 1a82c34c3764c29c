#include <meniscus/base/parallel.h>
#include <meniscus/sample/evenness.h>
#include <meniscus/sample/holes.h>
#include <meniscus/sample/surface_cell.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace meniscus::sample {
namespace {

constexpr double kBent = 0.7;  // cosine between the normals of neighbours
constexpr std::size_t kBlock = 256;

double largest_distance(const field::Field& surface, const SurfacePoints& points, const RunControl& run) {
  field::JetBatch jets(points.size(), field::Order::Gradient);
  field::evaluate(surface, points.positions(), jets.view(), run);
  double largest = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    largest = std::max(largest, std::abs(jets.value(i)) / jets.gradient(i).norm());
  return largest;
}

}  // namespace

Neighbours cell_neighbours(const SurfacePoints& points, std::span<const double> spacing, const RunControl& run) {
  std::vector<double> reach(spacing.begin(), spacing.end());
  for (double& r : reach) r *= 2 * kCellLimit;
  return find_neighbours(points.positions(), reach, run);
}

std::vector<CellMeasure> measure_cells(const SurfacePoints& points, std::span<const double> spacing,
                                       const Neighbours& neighbours, const Box& box, const RunControl& run,
                                       std::span<const std::uint8_t> asked) {
  std::vector<CellMeasure> out(points.size());
  parallel_blocks(points.size(), kBlock, run, [&](std::size_t begin, std::size_t end) {
    SurfaceCell cell;
    for (std::size_t i = begin; i < end; ++i) {
      out[i].local_spacing = spacing[i];
      if (!asked.empty() && !asked[i]) continue;
      cell.build(points, i, neighbours.of(i), kCellLimit * spacing[i], box);
      // In a graded sampling a cell is compared with the mean of its own and its neighbours' spacings.
      double sum = spacing[i], count = 1;
      bool bent = false;
      for (int k = 0; k < cell.sides(); ++k)
        if (cell.side(k) >= 0) {
          const auto j = static_cast<std::size_t>(cell.side(k));
          sum += spacing[j];
          ++count;
          bent = bent || points.normal(i).dot(points.normal(j)) < kBent;
        }
      out[i] = {cell.area(), cell.nearest(), cell.farthest(), cell.farthest_corner(),
                cell.open(), cell.share(),   sum / count,     bent};
    }
  });
  return out;
}

std::size_t count_components(const SurfacePoints& points, std::span<const double> spacing, const Neighbours& neighbours) {
  std::vector<std::uint32_t> root(points.size());
  std::iota(root.begin(), root.end(), 0u);
  const auto find = [&](std::uint32_t i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  };
  std::size_t parts = points.size();
  for (std::uint32_t i = 0; i < points.size(); ++i)
    for (const std::uint32_t j : neighbours.of(i)) {
      const double limit = 0.85 * (spacing[i] + spacing[j]);
      if (j > i || same_sheet(points, i, j) <= 0 || (points.position(i) - points.position(j)).norm() > limit) continue;
      const std::uint32_t a = find(i), b = find(j);
      if (a == b) continue;
      root[std::max(a, b)] = std::min(a, b);
      --parts;
    }
  return parts;
}

Evenness evenness(const field::Field& surface, const Box& box, const SurfacePoints& points, std::span<const double> spacing,
                  const RunControl& run) {
  const Neighbours neighbours = cell_neighbours(points, spacing, run);
  return evenness(surface, box, points, spacing, neighbours, measure_cells(points, spacing, neighbours, box, run), run);
}

Evenness evenness(const field::Field& surface, const Box& box, const SurfacePoints& points, std::span<const double> spacing,
                  const Neighbours& neighbours, std::span<const CellMeasure> cells, const RunControl& run) {
  Evenness e;
  e.count = points.size();
  if (points.empty()) return e;
  e.components = count_components(points, spacing, neighbours);
  e.max_distance = largest_distance(surface, points, run);

  // Distances in local spacings; `lattice` is what the hexagonal lattice would have.
  double patches = 0, full = 0, sum = 0, sum2 = 0, smallest = std::numeric_limits<double>::infinity(), largest = 0;
  std::size_t pairs = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    e.area += cells[i].area;
    patches += cells[i].area / (spacing[i] * spacing[i]);
    full += cells[i].share;
    e.open += cells[i].open;
    if (!cells[i].open && !cells[i].bent) largest = std::max(largest, cells[i].farthest / cells[i].local_spacing);
    if (!std::isfinite(cells[i].nearest)) continue;
    const double d = cells[i].nearest / cells[i].local_spacing;
    sum += d;
    sum2 += d * d;
    ++pairs;
    smallest = std::min(smallest, d);
  }
  // Where tangent planes cannot be trusted, places on the surface itself decide.
  const std::vector<Hole> holes = find_holes(surface, box, points, spacing, neighbours, cells, largest, run);
  if (!holes.empty()) largest = holes.front().radius;
  const double lattice = hexagonal_spacing(patches, full);
  e.cover = largest / (lattice / std::sqrt(3.0));
  if (pairs == 0) return e;
  const double mean = sum / static_cast<double>(pairs);
  e.packing = smallest / lattice;
  e.cv = std::sqrt(std::max(0.0, sum2 / static_cast<double>(pairs) - mean * mean)) / mean;
  return e;
}

}  // namespace meniscus::sample
