#include <meniscus/motion/tracker.h>
#include <meniscus/points/neighbours.h>
#include <meniscus/sample/floaters.h>
#include <meniscus/sample/spread.h>
#include <meniscus/scene/point_population.h>

#include <algorithm>
#include <cmath>

namespace meniscus::scene {
namespace {

constexpr double kOpen = 1;       // spacings to the nearest point, from where on a place is not covered
constexpr int kSteps = 40;        // of the floaters' own dynamics in a redistribution
constexpr double kTooNear = 0.8;  // spacings between two points born at once

/// The points of `positions` that can be put on the surface within a spacing; `numbers` tells which.
std::vector<Vec3> on_surface(const field::Field& surface, std::vector<Vec3> positions, double spacing, const RunControl& run,
                             std::vector<std::size_t>& numbers) {
  std::vector<std::uint8_t> lost;
  motion::project(surface, positions, std::vector<double>(positions.size(), spacing), run, &lost);
  std::vector<Vec3> result;
  numbers.clear();
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (lost[i] != 0) continue;
    result.push_back(positions[i]);
    numbers.push_back(i);
  }
  return result;
}

/// For every place the number of the nearest of `points`, which are some.
std::vector<std::size_t> nearest_of(const points::NeighbourSearch& points, std::span<const Vec3> places) {
  std::vector<std::size_t> result;
  std::vector<points::Neighbour> found;
  for (const Vec3& p : places) {
    points.nearest(p, 1, found);
    result.push_back(found[0].index);
  }
  return result;
}

}  // namespace

points::Cloud PointPopulation::first(const RunControl& run) const {
  const Box bounds = surface_.bounds();
  if (bounds.empty()) return {};
  return {sample::spread(surface_, bounds.padded(spacing_), {.spacing = spacing_}, run).cloud.positions, {}};
}

std::size_t PointPopulation::redistribute(points::Cloud& cloud, const RunControl& run) const {
  const Box bounds = surface_.bounds();
  if (cloud.empty() || bounds.empty()) return cloud.size();
  const double radius = spacing_ / 2;
  sample::Floaters floaters(bounds.padded(spacing_), {.radius = radius}, run);
  const field::JetBatch jets = field::evaluate(surface_, cloud.positions, field::Order::Gradient, run);
  for (std::size_t i = 0; i < cloud.size(); ++i) floaters.add(cloud.positions[i], jets.gradient(i).normalized(), radius);
  for (int step = 0; step < kSteps; ++step) floaters.step(surface_);

  // Floaters are numbered as they were added; those born later follow.
  std::vector<std::pair<std::int64_t, std::size_t>> order;
  for (std::size_t i = 0; i < floaters.size(); ++i) order.emplace_back(floaters.ids()[i], i);
  std::sort(order.begin(), order.end());
  std::vector<Vec3> places;
  for (const auto& [id, i] : order) places.push_back(floaters.points().position(i));
  std::vector<std::size_t> numbers;
  places = on_surface(surface_, std::move(places), spacing_, run, numbers);

  const points::NeighbourSearch old(cloud.positions);
  std::vector<std::size_t> source = nearest_of(old, places);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto id = static_cast<std::size_t>(order[numbers[i]].first);
    if (id >= cloud.size()) continue;
    source[i] = id;
    kept = i + 1;
  }
  cloud = {std::move(places), cloud.attributes.gathered(source)};
  return kept;
}

void PointPopulation::cover(points::Cloud& cloud, std::span<const Vec3> probes, const RunControl& run) const {
  const points::NeighbourSearch old(cloud.positions);
  std::vector<points::Neighbour> found;
  std::vector<Vec3> open;
  for (const Vec3& p : probes) {
    old.nearest(p, 1, found);
    if (found.empty() || found[0].squared_distance > kOpen * kOpen * spacing_ * spacing_) open.push_back(p);
  }
  std::vector<std::size_t> numbers;
  std::vector<Vec3> born;
  for (const Vec3& p : on_surface(surface_, std::move(open), spacing_, run, numbers)) {
    bool free = true;
    for (const Vec3& q : born) free = free && (p - q).norm() >= kTooNear * spacing_;
    if (free) born.push_back(p);
  }
  if (born.empty()) return;
  std::vector<std::size_t> source(cloud.size());
  for (std::size_t i = 0; i < source.size(); ++i) source[i] = i;
  if (!cloud.empty())
    for (const std::size_t i : nearest_of(old, born)) source.push_back(i);
  cloud.positions.insert(cloud.positions.end(), born.begin(), born.end());
  cloud.attributes = cloud.attributes.gathered(source);
}

}  // namespace meniscus::scene
