// Sculpting a point-set surface. (1) An update: one step of the voxels' dynamics and all points that follow it, at the sizes
// of the paper's table [GHQ03], least of many on a pull that is under way. (2) What a thousand strokes all over a ball leave
// of the points' spacing. Usage: bench_pointset_sculpt [--strokes N] [--json FILE]
#include <meniscus/base/random.h>
#include <meniscus/pointset/grid_update.h>
#include <meniscus/pointset/local_fit.h>
#include <meniscus/pointset/sculptor.h>

#include <benchmarks/support/measure.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <string>

using namespace meniscus;
using namespace meniscus::pointset;

namespace {

PointSet ball(std::size_t count) {
  points::Cloud cloud;
  std::vector<double> normals;
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 1 - (2.0 * static_cast<double>(i) + 1) / static_cast<double>(count), r = std::sqrt(1 - z * z);
    const double a = golden * static_cast<double>(i);
    cloud.positions.emplace_back(r * std::cos(a), r * std::sin(a), z);
    normals.insert(normals.end(), {r * std::cos(a), r * std::sin(a), z});
  }
  cloud.attributes.set(attribute::kNormal, 3, normals);
  return fit(cloud);
}

/// A cube about the ball's pole with that many points inside, or a few more.
Box region_with(const PointSet& set, std::size_t points) {
  double low = 0, high = 1;
  for (int k = 0; k < 40; ++k) {
    const double half = 0.5 * (low + high);
    (points_inside(set, Box::around(Vec3(0, 0, 1), half)).size() < points ? low : high) = half;
  }
  return Box::around(Vec3(0, 0, 1), high);
}

struct Update {
  double wall_ms = 1e300, cpu_ms = 1e300;
  std::size_t moved = 0;
};

Update update(int voxels, std::size_t points) {
  PointSet set = ball(10'000);
  const Box region = region_with(set, points);
  const double radius = 0.25 * region.size().x();
  SculptGrid grid(region, voxels, {1, 4, radius * radius});
  const PointSetField surface(set);
  std::vector<Vec3> places;
  for (std::size_t i = 0; i < grid.size(); ++i) places.push_back(grid.position(i));
  const field::JetBatch jets = field::evaluate(surface, places, field::Order::Value);
  std::vector<double> values;
  for (std::size_t i = 0; i < grid.size(); ++i) values.push_back(jets.value(i));
  grid.set_base(values);
  for (std::size_t i = 0; i < grid.size(); ++i)
    grid.load()[i] =
        static_cast<float>(-0.5 * radius * std::exp(-(places[i] - Vec3(0, 0, 1)).squaredNorm() / (radius * radius)));
  std::vector<std::uint32_t> inside = points_inside(set, grid.bounds());
  inside.resize(points);
  Update best;
  for (int k = 0; k < 60; ++k) {
    GridUpdate done;
    const bench::Measure m = bench::measure([&] {
      grid.step(1.0 / 60);
      done = follow_grid(set, inside, grid, 1.0 / 60);
    });
    best.wall_ms = std::min(best.wall_ms, 1e3 * m.seconds);
    best.cpu_ms = std::min(best.cpu_ms, 1e3 * m.cpu_seconds);
    best.moved = std::max(best.moved, done.moved);
  }
  return best;
}

/// A stroke anywhere on the present surface with any tool.
Stroke any_stroke(const PointSet& set, std::uint64_t number) {
  const auto u = random_uniform(1, number, 0), v = random_uniform(1, number, 1);
  constexpr Stroke::Tool kTools[] = {Stroke::Tool::Force,   Stroke::Tool::Inflate, Stroke::Tool::Smooth,
                                     Stroke::Tool::Flatten, Stroke::Tool::Crease,  Stroke::Tool::Drag};
  Stroke s;
  s.tool = kTools[static_cast<std::size_t>(u[0] * 6)];
  const Vec3 at = set.position(static_cast<std::size_t>(u[1] * static_cast<double>(set.size())));
  s.path = {at};
  s.radius = 0.1 + 0.2 * u[2];
  const bool share = s.tool == Stroke::Tool::Smooth || s.tool == Stroke::Tool::Flatten;
  s.strength = share ? 0.5 : (u[3] < 0.5 ? -1 : 1) * 0.3 * s.radius;
  s.direction = Vec3(v[0] - 0.5, v[1] - 0.5, v[2] - 0.5);
  if (s.tool != Stroke::Tool::Drag) s.direction.reset();
  s.voxels = 16;
  s.steps = 4;
  return s;
}

nlohmann::json many_strokes(std::uint64_t count) {
  Sculptor sculptor(ball(5'000));
  std::size_t inserted = 0, removed = 0;
  const bench::Measure m = bench::measure([&] {
    for (std::uint64_t k = 0; k < count; ++k) {
      const StrokeReport r = sculptor.apply(any_stroke(sculptor.set(), k));
      inserted += r.inserted;
      removed += r.removed;
    }
  });
  const auto places = positions(sculptor.set());
  const auto lists = points::nearest_neighbours(places, 1);
  std::vector<double> nearest;
  for (std::size_t i = 0; i < places.size(); ++i)
    nearest.push_back((places[lists.of(i)[0]] - places[i]).norm() / sculptor.spacing());
  std::sort(nearest.begin(), nearest.end());
  const auto at = [&](double share) {
    return nearest[static_cast<std::size_t>(share * static_cast<double>(nearest.size() - 1))];
  };
  return {{"strokes", count},
          {"points", places.size()},
          {"inserted", inserted},
          {"removed", removed},
          {"cpu_seconds", m.cpu_seconds},
          {"least", at(0)},
          {"p1", at(0.01)},
          {"median", at(0.5)},
          {"p99", at(0.99)},
          {"greatest", at(1)}};
}

}  // namespace

int main(int argc, char** argv) {
  std::uint64_t strokes = 1000;
  std::string json;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::string(argv[i]) == "--strokes") strokes = std::stoull(argv[i + 1]);
    if (std::string(argv[i]) == "--json") json = argv[i + 1];
  }
  struct Case {
    int voxels;
    std::size_t points;
    double paper_ms;
  };
  constexpr Case kCases[] = {{40, 225, 67}, {40, 450, 169}, {40, 910, 381}, {50, 361, 117}, {60, 514, 219}};
  nlohmann::json report;
  std::printf(
      "| voxels | points | moved | ours, ms | ours, ms of processor time | paper, ms |\n|---|---|---|---|---|---|\n");
  for (const Case& c : kCases) {
    const Update u = update(c.voxels, c.points);
    std::printf("| %d³ | %zu | %zu | %.2f | %.2f | %.0f |\n", c.voxels, c.points, u.moved, u.wall_ms, u.cpu_ms, c.paper_ms);
    std::fflush(stdout);
    report["updates"].push_back(
        {{"voxels", c.voxels}, {"points", c.points}, {"ms", u.wall_ms}, {"cpu_ms", u.cpu_ms}, {"paper_ms", c.paper_ms}});
  }
  if (strokes > 0) {
    const nlohmann::json s = report["strokes"] = many_strokes(strokes);
    std::printf(
        "\n| strokes | points | inserted | removed | s of processor time | nearest neighbour / spacing at the start: least "
        "| 1 %% | median | 99 %% | greatest |\n"
        "|---|---|---|---|---|---|---|---|---|---|\n| %d | 5000 → %d | %d | %d | %.1f | %.2f | %.2f | %.2f | %.2f | %.2f "
        "|\n",
        s["strokes"].get<int>(), s["points"].get<int>(), s["inserted"].get<int>(), s["removed"].get<int>(),
        s["cpu_seconds"].get<double>(), s["least"].get<double>(), s["p1"].get<double>(), s["median"].get<double>(),
        s["p99"].get<double>(), s["greatest"].get<double>());
  }
  if (!json.empty()) std::ofstream(json) << report.dump(2) << "\n";
  return 0;
}
