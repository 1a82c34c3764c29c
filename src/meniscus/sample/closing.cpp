#include <meniscus/sample/closing.h>
#include <meniscus/sample/evenness.h>
#include <meniscus/sample/holes.h>
#include <meniscus/sample/neighbour_grid.h>
#include <meniscus/sample/point_hash.h>
#include <meniscus/sample/projection.h>
#include <meniscus/sample/relax.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace meniscus::sample {
namespace {

constexpr double kApart = 1.5;   // spacings between two changes of one round
constexpr double kTwins = 0.05;  // spacings below which two points are one
constexpr RelaxOptions kSettle{.reach = 2, .steps = 5, .momentum = 0.8};

std::vector<CellMeasure> cells_of(Population& p, const Box& box, const RunControl& run) {
  p.near.refresh(p.points, p.spacing, run);
  return measure_cells(p.points, p.spacing, p.near.lists(), box, run);
}

/// Indices by falling key; equal keys by index.
std::vector<std::uint32_t> by_falling(const std::vector<double>& key) {
  std::vector<std::uint32_t> order(key.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return key[a] > key[b] || (key[a] == key[b] && a < b); });
  return order;
}

/// Takes places in order, at most `count` and none within its limit of one taken before.
std::vector<std::uint32_t> spread_out(const std::vector<Vec3>& places, const std::vector<double>& limits, const Box& box,
                                      std::size_t count) {
  std::vector<std::uint32_t> taken;
  if (places.empty()) return taken;
  PointHash hash(box.center(), *std::max_element(limits.begin(), limits.end()));
  for (std::uint32_t i = 0; i < places.size() && taken.size() < count; ++i) {
    const bool near = hash.any_near(places[i], limits[i],
                                    [&](std::uint32_t k) { return (places[taken[k]] - places[i]).norm() < limits[i]; });
    if (near) continue;
    hash.insert(places[i]);
    taken.push_back(i);
  }
  return taken;
}

/// What n hexagonal cells of the particles' spacings cover.
double tiled(const Population& p, std::span<const CellMeasure> cells) {
  double tiles = 0;
  for (std::size_t i = 0; i < p.points.size(); ++i)  // newcomers have no cell yet
    tiles += (i < cells.size() ? cells[i].share : 1) * 0.5 * std::sqrt(3.0) * p.spacing[i] * p.spacing[i];
  return tiles;
}

double area_of(std::span<const CellMeasure> cells) {
  double area = 0;
  for (const CellMeasure& c : cells) area += c.area;
  return area;
}

/// fit_spacing() for cells that have been measured.
void fit_to(double area, double tiles, Population& p) {
  const double factor = std::sqrt(area / tiles);
  for (double& s : p.spacing) s *= factor;
}

/// Inserts up to `count` points in the largest empty circles, those of at least `least` spacings.
std::size_t insert(const field::Field& surface, const Box& box, std::size_t count, double least, Population& p,
                   const RunControl& run) {
  const std::vector<CellMeasure> cells = cells_of(p, box, run);
  const std::vector<Hole> holes = find_holes(surface, box, p.points, p.spacing, p.near.lists(), cells, least, run);
  std::vector<Vec3> centers;
  std::vector<double> limits;
  for (const Hole& h : holes) {
    centers.push_back(h.center);
    limits.push_back(kApart * p.spacing[h.particle]);
  }
  const std::vector<std::uint32_t> where = spread_out(centers, limits, box, count);
  for (const std::uint32_t k : where) {
    p.push_back(holes[k].center, holes[k].normal, p.spacing[holes[k].particle]);
  }
  if (!where.empty()) fit_to(area_of(cells), tiled(p, cells), p);
  return where.size();
}

std::size_t remove(const Box& box, std::size_t count, Population& p, const RunControl& run) {
  const std::vector<CellMeasure> cells = cells_of(p, box, run);
  std::vector<double> crowding(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i)
    crowding[i] = -cells[i].area / (cells[i].share * p.spacing[i] * p.spacing[i]);
  const std::vector<std::uint32_t> order = by_falling(crowding);
  std::vector<Vec3> places;
  std::vector<double> limits;
  for (const std::uint32_t i : order) {
    places.push_back(p.points.position(i));
    limits.push_back(kApart * p.spacing[i]);
  }
  const std::vector<std::uint32_t> gone = spread_out(places, limits, box, count);
  std::vector<std::uint8_t> removed(cells.size(), 0);
  for (const std::uint32_t k : gone) removed[order[k]] = 1;
  std::vector<std::uint32_t> kept;
  for (std::uint32_t i = 0; i < removed.size(); ++i)
    if (!removed[i]) kept.push_back(i);
  p = p.gathered(kept);
  const double area = area_of(cells);
  if (!gone.empty()) fit_to(area, tiled(p, gathered(cells, kept)), p);
  return gone.size();
}

}  // namespace

void Population::push_back(const Vec3& position, const Vec3& normal, double wanted) {
  points.push_back(position, normal);
  spacing.push_back(wanted);
  if (id.size() + 1 == points.size()) id.push_back(kNewcomer);
}

Population Population::gathered(std::span<const std::uint32_t> order) const {
  return {points.gathered(order), sample::gathered(spacing, order), id.empty() ? id : sample::gathered(id, order), {}};
}

std::size_t hexagonal_count(Population& p, const Box& box, const RunControl& run) {
  const std::vector<CellMeasure> cells = cells_of(p, box, run);
  double n = 0;
  for (std::size_t i = 0; i < cells.size(); ++i)  // half of a point on a face lies outside
    n += cells[i].area / (0.5 * std::sqrt(3.0) * p.spacing[i] * p.spacing[i]) + 1 - cells[i].share;
  return std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(n)));
}

void fit_spacing(Population& p, const Box& box, const RunControl& run) {
  if (p.points.empty()) return;
  const std::vector<CellMeasure> cells = cells_of(p, box, run);
  fit_to(area_of(cells), tiled(p, cells), p);
}

bool reach_count(const field::Field& surface, const Box& box, const Density& density, std::size_t count, int rounds,
                 Population& p, const RunControl& run) {
  for (int round = 0; round < rounds && p.points.size() != count && !p.points.empty(); ++round) {
    if (round > 0) relax(surface, box, p.points, p.spacing, kSettle, run, {}, &p.near);
    const std::size_t n = p.points.size();
    const std::size_t changed = n < count ? insert(surface, box, count - n, 0, p, run) : remove(box, n - count, p, run);
    if (changed == 0) break;
    if (!density.uniform()) {
      p.spacing = wanted_spacing(surface, density, *std::max_element(p.spacing.begin(), p.spacing.end()), p.points, run);
      fit_spacing(p, box, run);
    }
    sort_spatially(p);
  }
  return p.points.size() == count;
}

std::size_t fill_holes(const field::Field& surface, const Box& box, double largest, std::size_t max_count, Population& p,
                       const RunControl& run) {
  if (p.points.empty() || p.points.size() >= max_count) return 0;
  const std::size_t filled = insert(surface, box, max_count - p.points.size(), largest / std::sqrt(3.0), p, run);
  if (filled > 0) sort_spatially(p);
  return filled;
}

std::size_t land(const field::Field& surface, const Box& box, double tolerance, Population& p, const RunControl& run) {
  if (p.points.empty()) return 0;
  const double reach = *std::max_element(p.spacing.begin(), p.spacing.end());
  const std::vector<std::uint8_t> arrived =
      project(surface, box, {.tolerance = tolerance, .max_distance = reach}, p.points, run);
  std::vector<std::uint32_t> kept;
  PointHash hash(box.center(), reach);
  for (std::uint32_t i = 0; i < arrived.size(); ++i) {
    const double apart = kTwins * p.spacing[i];
    const auto twin = [&](std::uint32_t k) {
      return (p.points.position(kept[k]) - p.points.position(i)).norm() < apart &&
             p.points.normal(kept[k]).dot(p.points.normal(i)) > 0;
    };
    if (!arrived[i] || hash.any_near(p.points.position(i), apart, twin)) continue;
    hash.insert(p.points.position(i));
    kept.push_back(i);
  }
  if (kept.size() < arrived.size()) p = p.gathered(kept);
  return arrived.size() - kept.size();
}

void sort_spatially(Population& p) {
  if (p.points.empty()) return;
  const std::vector<std::uint32_t> order =
      spatial_order(p.points.positions(), *std::min_element(p.spacing.begin(), p.spacing.end()));
  p = p.gathered(order);
}

}  // namespace meniscus::sample
