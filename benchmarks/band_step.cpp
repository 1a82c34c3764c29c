// A step of the narrow band: upwind transport with tension, against OpenVDB's LevelSetMorphing (first order) on a ball of
// the same size, in one run. Counted in active voxels per second of processor time of all threads, so that a busy machine
// does not decide. Usage: bench_band_step [--json FILE] [--radius VOXELS]
#include <meniscus/band/evolver.h>
#include <meniscus/band/kernels.h>
#include <meniscus/base/parallel.h>
#include <meniscus/field/primitives.h>

#include <nlohmann/json.hpp>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetMorph.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <chrono>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <string>

using namespace meniscus;

namespace {

struct Row {
  std::string what;
  double voxels;  // active ones times steps
  double cpu, wall;
};

template <class Work>
Row measure(const std::string& what, const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpu = std::clock();
  const double voxels = work();
  const double taken = static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC;
  return {what, voxels, taken, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()};
}

class Outwards final : public band::Strategy {
 public:
  std::string name() const override { return "outwards"; }
  void add_speed(const band::SurfaceSamples&, std::span<double> speed, const RunControl&) override {
    for (double& v : speed) v += 1;
  }
};

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
  const double active = static_cast<double>(start.active_nodes());
  std::vector<Row> rows;

  rows.push_back(measure("ours: transport + tension kernel with halo", [&] {
    constexpr int kSteps = 20;
    band::StepCoefficients c;
    c.tension = 0.1f;
    c.c = 0.4f;
    const std::vector<float> speed(start.values().size(), 1.0f);
    std::vector<float> out(speed.size());
    for (int s = 0; s < kSteps; ++s)
      parallel_for(start.brick_count(), 16, {}, [&](std::size_t b) {
        float halo[band::kHaloSize];
        band::gather_halo(start, start.values().data(), b, start.background(), -start.background(), halo);
        band::kernels().step(halo, speed.data() + b * 512, nullptr, c, out.data() + b * 512);
      });
    return kSteps * active;
  }));
  rows.push_back(measure("ours: whole step (crossings, extension, tension, waking, redistancing)", [&] {
    band::EvolverOptions o;
    o.tension = 0.1;
    band::Evolver skin(start, o);
    skin.add(std::make_shared<Outwards>());
    double voxels = 0;
    for (int s = 0; s < 10; ++s) {
      skin.advance(0, 0.5);
      voxels += static_cast<double>(skin.band().active_nodes());
    }
    return voxels;
  }));
  rows.push_back(measure("OpenVDB LevelSetMorphing, first order, with its tracking", [&] {
    const float r = static_cast<float>(radius);
    auto from = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(r, {0, 0, 0}, 1.0f, 4.0f);
    auto to = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(r + 20, {0, 0, 0}, 1.0f, 40.0f);
    openvdb::tools::LevelSetMorphing<openvdb::FloatGrid> morph(*from, *to);
    morph.setSpatialScheme(openvdb::math::FIRST_BIAS);
    morph.setTemporalScheme(openvdb::math::TVD_RK1);
    morph.setTrackerSpatialScheme(openvdb::math::FIRST_BIAS);
    morph.setTrackerTemporalScheme(openvdb::math::TVD_RK1);
    morph.setNormCount(1);
    double steps = 0;
    for (int s = 0; s < 4; ++s)
      steps += static_cast<double>(morph.advect(0.05f * static_cast<float>(s), 0.05f * static_cast<float>(s + 1)));
    return steps * static_cast<double>(from->activeVoxelCount());
  }));

  std::printf("| step | Mvoxel per processor second | wall s |\n|---|---|---|\n");
  nlohmann::json table = nlohmann::json::array();
  for (const Row& r : rows) {
    const double rate = r.cpu > 0 ? r.voxels / r.cpu / 1e6 : 0;
    std::printf("| %s | %.2f | %.3f |\n", r.what.c_str(), rate, r.wall);
    table.push_back({{"step", r.what}, {"mvoxel_per_cpu_second", rate}, {"wall_seconds", r.wall}});
  }
  if (!json.empty()) std::ofstream(json) << table.dump(1) << '\n';
}
