// A step of the narrow band. First against OpenVDB's LevelSetMorphing (first order) from one ball towards a larger one, in
// one run; then what a step costs as the grid grows from 64³ to 512³. Counted in processor time of all threads, so that a
// busy machine does not decide.
//
// Like with like: a step of LevelSetMorphing samples the goal at every active voxel, takes one first-order upwind step of at
// most 0.3/√3 voxel, dilates by a voxel, renormalises once (or, in a row of its own, not at all: then its samples are no
// distances for long) and trims. Our whole step finds the crossings, evaluates the goal there, extends the speeds, takes one
// second-order upwind step of at most half a voxel with tension, renews distances near the surface, through the whole band
// and with waking and dropping of bricks every second step. At a given speed it does all of that but the goal. The kernel's
// row is transport and tension alone, of every node of the band, where a step needs but those next to the surface.
// Usage: bench_band_step [--json FILE] [--radius VOXELS]
#include <meniscus/band/evolver.h>
#include <meniscus/band/kernels.h>
#include <meniscus/band/redistance.h>
#include <meniscus/base/parallel.h>
#include <meniscus/field/primitives.h>

#include <benchmarks/support/measure.h>
#include <nlohmann/json.hpp>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetMorph.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <string>

using namespace meniscus;

namespace {

constexpr double kWay = 20;   // voxels from the ball to its goal
constexpr double kSpeed = 3;  // voxels per second: half a voxel in each of our steps
constexpr int kRounds = 3;    // the fastest counts

/// Active voxels times steps, and active voxels times the way of the surface in voxels, per second of processor time.
struct Rate {
  double stepped = 0, moved = 0;
};

template <class Work>
Rate fastest(const Work& work) {
  Rate best;
  for (int i = 0; i < kRounds; ++i) {
    const Rate r = work();
    if (r.stepped > best.stepped) best = r;
  }
  return best;
}

double radius_of(const band::Band& b) {
  double volume = 0;
  for (const band::Component& c : band::measure_components(b, band::label_components(b))) volume += c.volume;
  return std::cbrt(volume * 3 / (4 * M_PI));
}

Rate kernel(const band::Band& band) {
  constexpr int kSteps = 20;
  band::StepCoefficients c;
  c.tension = 0.1f;
  c.c = 0.5f;
  band::Halo speed;
  std::fill(std::begin(speed.samples), std::end(speed.samples), 1.0f);
  std::vector<float> out(band.values().size());
  const bench::Measure m = bench::measure([&] {
    for (int s = 0; s < kSteps; ++s) {
      parallel_for(band.brick_count(), 16, {}, [&](std::size_t b) {
        band::Halo halo;
        band::gather_halo(band, band.values().data(), b, band.background(), -band.background(), halo);
        band::kernels().step(halo, speed, nullptr, c, band::kAllRows, out.data() + b * 512);
      });
    }
  });
  const double voxels = kSteps * static_cast<double>(band.active_nodes());
  return {voxels / m.cpu_seconds, 0.5 * voxels / m.cpu_seconds};
}

/// The same speed at every crossing: what a step costs besides its strategies.
class Steady final : public band::Strategy {
 public:
  std::string name() const override { return "steady"; }
  void add_speed(const band::SurfaceSamples&, std::span<double> speed, const RunControl&) override {
    for (double& v : speed) v += kSpeed;
  }
  bool needs_normals() const override { return false; }
};

Rate whole_step(const band::Band& start, std::shared_ptr<band::Strategy> strategy) {
  band::EvolverOptions o;
  o.tension = 0.1;
  band::Evolver skin(start, o);
  skin.add(std::move(strategy));
  skin.advance(0, 0.5);
  const double active = static_cast<double>(skin.band().active_nodes()), before = radius_of(skin.band());
  int steps = 0;
  const bench::Measure m = bench::measure([&] { steps = skin.advance(0, 2).steps; });
  const double mean = 0.5 * (active + static_cast<double>(skin.band().active_nodes()));
  return {mean * steps / m.cpu_seconds, mean * (radius_of(skin.band()) - before) / m.cpu_seconds};
}

Rate openvdb_step(double radius, int normalisations) {
  const float r = static_cast<float>(radius), way = static_cast<float>(kWay);
  auto from = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(r, {0, 0, 0}, 1.0f, 4.0f);
  auto to = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(r + way, {0, 0, 0}, 1.0f, 2 * way);
  openvdb::tools::LevelSetMorphing<openvdb::FloatGrid> morph(*from, *to);
  morph.setSpatialScheme(openvdb::math::FIRST_BIAS);
  morph.setTemporalScheme(openvdb::math::TVD_RK1);
  morph.setTrackerSpatialScheme(openvdb::math::FIRST_BIAS);
  morph.setTrackerTemporalScheme(openvdb::math::TVD_RK1);
  morph.setNormCount(normalisations);
  const auto front = [&] {  // of the surface on the x axis
    for (int x = 1;; ++x) {
      const float here = from->tree().getValue({x, 0, 0}), back = from->tree().getValue({x - 1, 0, 0});
      if (here >= 0 && back < 0) return static_cast<double>(static_cast<float>(x) - here / (here - back));
    }
  };
  const double before = front(), active = static_cast<double>(from->activeVoxelCount());
  double steps = 0;
  const bench::Measure m = bench::measure([&] { steps = static_cast<double>(morph.advect(0.0f, 0.1f)); });
  const double mean = 0.5 * (active + static_cast<double>(from->activeVoxelCount()));
  return {mean * steps / m.cpu_seconds, mean * (front() - before) / m.cpu_seconds};
}

/// Bytes that an evolver holds while it steps: the samples four times over (samples, next, speeds, their extension) and once
/// more while bricks wake, outlines, neighbours, coordinates, the table of bricks.
double bytes(const band::Band& b) {
  return static_cast<double>(b.brick_count()) * (5 * 512 * sizeof(float) + sizeof(band::Outline) + 27 * 4 + 12 + 4 * 4);
}

template <class Work>
double quickest(const Work& work) {
  double best = std::numeric_limits<double>::infinity();
  for (int round = 0; round < 2 * kRounds; ++round) best = std::min(best, bench::measure(work).cpu_seconds);
  return best;
}

/// Processor seconds that parts of a step take for a whole band.
std::vector<std::pair<std::string, double>> parts(const band::Band& start, const field::Field& goal) {
  band::Band band = start;
  band::Outlines outlines = band::outlines_of(band);
  band::Crossings crossings;
  const double found = quickest([&] { band::find_crossings(band, outlines, false, crossings, {}); });
  std::vector<double> speed(crossings.size());
  const std::vector<std::int32_t> component(crossings.size());
  const band::SurfaceSamples samples{crossings, component, {}, band.voxel(), 0, 1};
  band::Target target(goal, 1, kSpeed);
  const double asked = quickest([&] { target.add_speed(samples, speed, {}); });
  band::NodeSpeeds near;
  const double meant = quickest([&] { band::near_speeds(band, crossings, speed, near); });
  std::vector<float> room;
  const double spread = quickest([&] { band::spread_distances(band, outlines, 3, room, {}); });
  std::vector<float> copy(band.values().size());
  const double copied = quickest([&] { std::copy(band.values().begin(), band.values().end(), copy.begin()); });
  return {{"crossings", found}, {"goal", asked}, {"means", meant}, {"distances", spread}, {"a copy", copied}};
}

nlohmann::json growth() {
  std::printf(
      "\n| grid | active nodes | ms per step | bytes per node | ns per node: step | crossings | goal | means | "
      "distances | a copy |\n|---|---|---|---|---|---|---|---|---|---|\n");
  nlohmann::json table = nlohmann::json::array();
  std::vector<std::pair<double, double>> points;
  for (const int n : {64, 128, 256, 512}) {
    const double radius = 0.35 * n;
    band::EvolverOptions o;
    o.tension = 0.1;
    const auto goal = field::sphere({0, 0, 0}, radius + 4);
    double best = std::numeric_limits<double>::infinity();
    std::size_t active = 0;
    double held = 0;
    const band::Band start = band::band_of(*field::sphere({0, 0, 0}, radius), 1);
    for (int round = 0; round < kRounds; ++round) {
      band::Evolver skin(start, o);
      skin.add(std::make_shared<band::Target>(*goal, 1.0, kSpeed));
      skin.advance(0, 2.0 / 6);  // memory is there from here on
      int steps = 0;
      const bench::Measure m = bench::measure([&] { steps = skin.advance(0, 1).steps; });
      best = std::min(best, m.cpu_seconds / steps);
      active = skin.band().active_nodes();
      held = bytes(skin.band()) / static_cast<double>(active);
    }
    points.emplace_back(std::log(static_cast<double>(n)), std::log(best));
    std::printf("| %d³ | %zu | %.2f | %.0f | %.1f |", n, active, 1e3 * best, held, 1e9 * best / static_cast<double>(active));
    nlohmann::json row = {{"grid", n}, {"active", active}, {"cpu_seconds_per_step", best}, {"bytes_per_active_node", held}};
    const double nodes = static_cast<double>(start.active_nodes());
    for (const auto& [what, seconds] : parts(start, *goal)) {
      std::printf(" %.1f |", 1e9 * seconds / nodes);
      row["cpu_seconds"][what] = seconds;
    }
    std::printf("\n");
    table.push_back(row);
  }
  double mx = 0, my = 0, xy = 0, xx = 0;
  for (const auto& [x, y] : points) {
    mx += x / static_cast<double>(points.size());
    my += y / static_cast<double>(points.size());
  }
  for (const auto& [x, y] : points) {
    xy += (x - mx) * (y - my);
    xx += (x - mx) * (x - mx);
  }
  std::printf("\nslope: time per step grows as n^%.2f\n", xy / xx);
  return {{"sizes", table}, {"exponent", xy / xx}};
}

}  // namespace

int main(int argc, char** argv) {
  double radius = 60;
  std::string json;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::string(argv[i]) == "--radius") radius = std::stod(argv[i + 1]);
    if (std::string(argv[i]) == "--json") json = argv[i + 1];
  }
  openvdb::initialize();
  const band::Band start = band::band_of(*field::sphere({0, 0, 0}, radius), 1);
  const auto goal = field::sphere({0, 0, 0}, radius + kWay);
  const std::pair<std::string, Rate> rows[] = {
      {"OpenVDB LevelSetMorphing, first order, one renormalisation", fastest([&] { return openvdb_step(radius, 1); })},
      {"OpenVDB LevelSetMorphing, first order, none", fastest([&] { return openvdb_step(radius, 0); })},
      {"ours: transport + tension kernel with its halo, all of the band", fastest([&] { return kernel(start); })},
      {"ours: step at a given speed", fastest([&] { return whole_step(start, std::make_shared<Steady>()); })},
      {"ours: step towards a goal",
       fastest([&] { return whole_step(start, std::make_shared<band::Target>(*goal, 1.0, kSpeed)); })},
  };
  const Rate peer = rows[0].second;
  std::printf("| step | Mvoxel/s | × | Mvoxel·voxel of way/s | × |\n|---|---|---|---|---|\n");
  nlohmann::json table = nlohmann::json::array();
  for (const auto& [what, r] : rows) {
    std::printf("| %s | %.2f | %.1f | %.2f | %.1f |\n", what.c_str(), r.stepped / 1e6, r.stepped / peer.stepped,
                r.moved / 1e6, r.moved / peer.moved);
    table.push_back(
        {{"step", what}, {"mvoxel_per_cpu_second", r.stepped / 1e6}, {"mvoxel_way_per_cpu_second", r.moved / 1e6}});
  }
  const nlohmann::json sizes = growth();
  if (!json.empty()) std::ofstream(json) << nlohmann::json{{"steps", table}, {"growth", sizes}}.dump(1) << '\n';
}
