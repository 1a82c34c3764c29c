// One frame of particles to a mesh: our skin (carried on from the frame before, with tension, held volume and velocities)
// against OpenVDB's ParticlesToLevelSet, three passes of its Gaussian filter and volumeToMesh, at the same voxel size in
// one run. Roughness is the mean angle between neighbouring triangles, both level sets meshed by the same mesher.
// Usage: bench_skin [--json FILE] [--full] [--profile]     --full adds a million particles, --profile runs ours alone
#include <meniscus/band/skin.h>
#include <meniscus/base/parallel.h>
#include <meniscus/base/random.h>
#include <meniscus/polygonize/polygonize.h>
#include <meniscus/scene/skin_job.h>

#include <Eigen/Geometry>
#include <benchmarks/support/measure.h>
#include <nlohmann/json.hpp>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetFilter.h>
#include <openvdb/tools/ParticlesToLevelSet.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <map>
#include <numbers>
#include <string>

using namespace meniscus;

namespace {

constexpr double kRadius = 0.75;
constexpr double kVoxel = 0.375;
constexpr int kFilterPasses = 3;

/// A rough pool, four times as wide as deep, with waves that travel and drops of some thirty particles above it. Particles
/// are one apart and shaken anew every frame.
points::Cloud pool(std::size_t count, int frame) {
  const double depth = std::cbrt(static_cast<double>(count) / 16);
  const int wide = static_cast<int>(4 * depth), high = static_cast<int>(1.3 * depth);
  points::Cloud cloud;
  std::vector<double> v;
  std::vector<std::int64_t> id;
  const auto add = [&](const Vec3& p, const Vec3& velocity) {
    const auto u = random_uniform(5, id.size(), static_cast<std::uint64_t>(frame));
    cloud.positions.push_back(p + 0.3 * Vec3(u[0] - 0.5, u[1] - 0.5, u[2] - 0.5));
    v.insert(v.end(), {velocity.x(), velocity.y(), velocity.z()});
    id.push_back(static_cast<std::int64_t>(id.size()));
  };
  const double move = 0.25 * frame, wave = 2 * std::numbers::pi / depth;
  for (int i = 0; i < wide; ++i)
    for (int k = 0; k < wide; ++k)
      for (int j = 0; j < high; ++j) {
        const double top = depth * (1 + 0.1 * std::sin(wave * i) * std::cos(wave * k));
        if (j < top) add(Vec3(i + move, j, k), Vec3(0.25, 0, 0));
      }
  for (int d = 0; d < static_cast<int>(count / 3000); ++d) {
    const auto u = random_uniform(9, static_cast<std::uint64_t>(d), 0);
    const Vec3 c(u[0] * wide + move, depth * (1.4 + u[1]), u[2] * wide);
    for (int n = 0; n < 125; ++n) {
      const Vec3 o(n / 25 - 2, n / 5 % 5 - 2, n % 5 - 2);
      if (o.norm() < 2.1) add(c + o, Vec3(0.25, 0, 0));
    }
  }
  cloud.attributes.set("v", 3, std::move(v));
  cloud.attributes.set_integers("id", 1, std::move(id));
  return cloud;
}

double memory_mb(const char* key) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.rfind(key, 0) == 0) return std::stod(line.substr(line.find(':') + 1)) / 1024;
  return 0;
}

/// Processor and wall seconds, and the peak of memory above what was there before.
struct Cost : bench::Measure {
  double peak_mb = 0;
};

template <class Work>
Cost cost_of(const Work& work) {
  std::ofstream("/proc/self/clear_refs") << "5";  // resets the peak
  const double before = memory_mb("VmRSS");
  Cost c{bench::measure(work)};
  c.peak_mb = memory_mb("VmHWM") - before;
  return c;
}

/// Mean angle between neighbouring triangles, degrees.
double roughness(const field::Grid& grid) {
  const mesh::Mesh m = polygonize::polygonize_grid(grid, {.normals = false}).mesh;
  std::map<std::pair<std::uint32_t, std::uint32_t>, Vec3> open;
  double sum = 0;
  std::size_t edges = 0;
  for (const auto& t : m.triangles) {
    const Vec3 n = (m.positions[t[1]] - m.positions[t[0]]).cross(m.positions[t[2]] - m.positions[t[0]]).normalized();
    for (std::size_t e = 0; e < 3; ++e) {
      const std::uint32_t a = t[e], b = t[(e + 1) % 3];
      const auto twin = open.find({b, a});
      if (twin == open.end()) {
        open.emplace(std::pair{a, b}, n);
        continue;
      }
      sum += std::acos(std::clamp(n.dot(twin->second), -1.0, 1.0));
      ++edges;
      open.erase(twin);
    }
  }
  return edges > 0 ? sum / static_cast<double>(edges) * 180 / std::numbers::pi : 0;
}

field::Grid ours(const openvdb::FloatGrid& grid) {
  std::vector<field::Coord> bricks;
  std::vector<float> values;
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
    const openvdb::Coord& o = leaf->origin();
    bricks.push_back({o.x() >> 3, o.y() >> 3, o.z() >> 3});
    const float* data = leaf->buffer().data();
    values.insert(values.end(), data, data + 512);
  }
  return {kVoxel, Vec3::Zero(), static_cast<double>(grid.background()), std::move(bricks), std::move(values)};
}

struct ParticleList {
  using PosType = openvdb::Vec3R;
  const points::Cloud& cloud;
  std::size_t size() const { return cloud.size(); }
  void getPos(std::size_t n, openvdb::Vec3R& x) const {
    const Vec3& p = cloud.positions[n];
    x = {p.x(), p.y(), p.z()};
  }
  void getPosRad(std::size_t n, openvdb::Vec3R& x, openvdb::Real& r) const {
    getPos(n, x);
    r = kRadius;
  }
};

void print(const char* what, const Cost& c, std::size_t triangles, double rough) {
  std::printf("| %s | %.2f | %.2f | %.0f | %zu | %.2f |\n", what, c.cpu_seconds, c.seconds, c.peak_mb, triangles, rough);
}

nlohmann::json to_json(const Cost& c) {
  return {{"cpu_seconds", c.cpu_seconds}, {"seconds", c.seconds}, {"peak_mb", c.peak_mb}};
}

nlohmann::json compare(std::size_t count, bool alone) {
  constexpr int kFrames = 3;
  std::vector<points::Cloud> frames;
  for (int f = 0; f <= kFrames; ++f) frames.push_back(pool(count, f));
  std::printf("\n%zu particles, radius 0.75, voxel 0.375\n\n", frames[0].size());
  std::puts("| stage | processor s | s | peak MB | triangles | roughness, degrees |\n|---|---|---|---|---|---|");
  nlohmann::json row = {{"particles", frames[0].size()}};

  band::SkinOptions options;
  options.radius = kRadius;
  options.voxel = kVoxel;
  band::Skin skin(options);
  const Cost first = cost_of([&] { skin.start(frames[0], 1); });
  Cost frame, meshing;
  mesh::Mesh mesh;
  for (int f = 1; f <= kFrames; ++f) {
    const Cost c = cost_of([&] { skin.advance(frames[static_cast<std::size_t>(f)], 1); });
    const Cost m = cost_of([&] { mesh = scene::skin_mesh(skin); });
    // The least of several: other work on the machine only adds.
    if (f == 1 || c.cpu_seconds < frame.cpu_seconds) frame = c;
    if (f == 1 || m.cpu_seconds < meshing.cpu_seconds) meshing = m;
  }
  const double our_roughness = alone ? 0 : roughness(skin.band().grid());
  print("ours, first frame without mesh", first, 0, 0);
  print("ours, a frame", frame, 0, our_roughness);
  print("ours, its mesh with N and v", meshing, mesh.triangles.size(), our_roughness);
  row["ours"] = {{"first", to_json(first)},
                 {"frame", to_json(frame)},
                 {"mesh", to_json(meshing)},
                 {"triangles", mesh.triangles.size()},
                 {"roughness_deg", our_roughness}};
  if (alone) return row;

  openvdb::FloatGrid::Ptr grid;
  const ParticleList list{frames[0]};
  const Cost rasterised = cost_of([&] {
    grid = openvdb::createLevelSet<openvdb::FloatGrid>(kVoxel, 3);
    openvdb::tools::ParticlesToLevelSet<openvdb::FloatGrid> raster(*grid);
    raster.rasterizeSpheres(list);
    raster.finalize(true);
  });
  const Cost filtered = cost_of([&] {
    openvdb::tools::LevelSetFilter<openvdb::FloatGrid> filter(*grid);
    for (int pass = 0; pass < kFilterPasses; ++pass) filter.gaussian(1);
  });
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec4I> quads;
  const Cost polygons = cost_of([&] { openvdb::tools::volumeToMesh(*grid, points, quads); });
  const double their_roughness = roughness(ours(*grid));
  print("OpenVDB ParticlesToLevelSet", rasterised, 0, 0);
  print("OpenVDB three Gaussian passes", filtered, 0, their_roughness);
  print("OpenVDB volumeToMesh", polygons, 2 * quads.size(), their_roughness);
  const double theirs = rasterised.cpu_seconds + filtered.cpu_seconds + polygons.cpu_seconds;
  const double us = frame.cpu_seconds + meshing.cpu_seconds;
  std::printf("\nOpenVDB / ours, processor time: %.1f\n", theirs / us);
  row["openvdb"] = {{"particles_to_level_set", to_json(rasterised)},
                    {"filter", to_json(filtered)},
                    {"volume_to_mesh", to_json(polygons)},
                    {"triangles", 2 * quads.size()},
                    {"roughness_deg", their_roughness}};
  row["ratio"] = theirs / us;
  return row;
}

}  // namespace

int main(int argc, char** argv) {
  std::string json;
  bool full = false, alone = false;
  for (int i = 1; i < argc; ++i) {
    const std::string a = argv[i];
    if (a == "--full") full = true;
    if (a == "--profile") alone = true;
    if (a == "--json" && i + 1 < argc) json = argv[++i];
  }
  openvdb::initialize();
  nlohmann::json table = nlohmann::json::array();
  std::vector<std::size_t> counts{10'000, 100'000};
  if (full) counts.push_back(1'000'000);
  for (const std::size_t n : counts) table.push_back(compare(n, alone));
  if (!json.empty()) std::ofstream(json) << table.dump(1) << '\n';
}
