// Any field -> mesh: our polygonizer against sampling the same field onto an OpenVDB grid and running volumeToMesh, in one
// run on the same bricks; and our grid mesher against volumeToMesh on the same samples.
// Usage: bench_polygonize [--json FILE] [--triangles N]
#include <meniscus/base/parallel.h>
#include <meniscus/base/random.h>
#include <meniscus/field/blobs.h>
#include <meniscus/field/primitives.h>
#include <meniscus/mesh/validate.h>
#include <meniscus/polygonize/bricks_near.h>
#include <meniscus/polygonize/polygonize.h>

#include <nlohmann/json.hpp>
#include <openvdb/openvdb.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <string>

using namespace meniscus;

namespace {

struct Measure {
  double seconds = 0;
  double cpu_seconds = 0;  // of all threads: what counts on a busy machine
  double peak_mb = 0;      // above what was there before
};

double memory_mb(const char* key) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.rfind(key, 0) == 0) return std::stod(line.substr(line.find(':') + 1)) / 1024;
  return 0;
}

template <class Work>
Measure measure(const Work& work) {
  std::ofstream("/proc/self/clear_refs") << "5";  // resets the peak
  const double before = memory_mb("VmRSS");
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpu = std::clock();
  work();
  const double cpu_taken = static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC;
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  return {taken.count(), cpu_taken, memory_mb("VmHWM") - before};
}

/// The samples of the bricks near the surface, as a grid of ours.
field::Grid sampled(const field::Field& field, double voxel) {
  const Box box = field.bounds().padded(voxel);
  const polygonize::ClippedField clipped(field, box);
  polygonize::Lattice lattice;
  lattice.voxel = voxel;
  for (std::size_t a = 0; a < 3; ++a) {
    lattice.low[a] = static_cast<std::int32_t>(std::floor(box.min[static_cast<Eigen::Index>(a)] / voxel));
    lattice.high[a] = static_cast<std::int32_t>(std::ceil(box.max[static_cast<Eigen::Index>(a)] / voxel));
  }
  std::vector<field::Coord> bricks = polygonize::bricks_near(clipped, lattice, std::size_t{1} << 40, {}).bricks;
  std::vector<float> values(512 * bricks.size());
  parallel_for(bricks.size(), 8, {}, [&](std::size_t b) {
    std::array<double, 512> x;
    std::array<double, 512> y;
    std::array<double, 512> z;
    std::array<double, 512> f;
    for (int n = 0; n < 512; ++n) {
      const auto i = static_cast<std::size_t>(n);
      x[i] = voxel * (8 * bricks[b][0] + (n >> 6));
      y[i] = voxel * (8 * bricks[b][1] + ((n >> 3) & 7));
      z[i] = voxel * (8 * bricks[b][2] + (n & 7));
    }
    field.evaluate({x.data(), y.data(), z.data(), 512}, {f.data(), 512, 512, field::Order::Value});
    for (std::size_t i = 0; i < 512; ++i) values[512 * b + i] = static_cast<float>(f[i]);
  });
  return {voxel, Vec3::Zero(), 3 * voxel, std::move(bricks), std::move(values)};
}

openvdb::FloatGrid::Ptr to_openvdb(const field::Grid& grid) {
  auto result = openvdb::FloatGrid::create(static_cast<float>(grid.background()));
  result->setTransform(openvdb::math::Transform::createLinearTransform(grid.voxel()));
  result->setGridClass(openvdb::GRID_LEVEL_SET);
  for (std::size_t b = 0; b < grid.bricks().size(); ++b) {
    const field::Coord& c = grid.bricks()[b];
    auto* leaf = result->tree().touchLeaf({8 * c[0], 8 * c[1], 8 * c[2]});
    std::copy(grid.brick(b).begin(), grid.brick(b).end(), leaf->buffer().data());
    leaf->setValuesOn();
  }
  openvdb::tools::signedFloodFill(result->tree());
  return result;
}

struct OpenVdbMesh {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  std::vector<openvdb::Vec4I> quads;
  std::size_t count() const { return triangles.size() + 2 * quads.size(); }
};

struct Case {
  std::string name;
  std::unique_ptr<field::Field> field;
  double area;
};

std::vector<Case> cases() {
  std::vector<Case> list;
  list.push_back({"sphere", field::sphere({0.0, 0.0, 0.0}, 1.0), 4 * 3.14159});
  std::vector<Vec3> centers;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    const auto r = random_uniform(1, i, 0);
    centers.emplace_back(r[0], r[1], r[2]);
  }
  list.push_back({"2,000 blobs", field::particles(centers, std::vector<double>{0.025}), 8.6});
  return list;
}

nlohmann::json run_case(const Case& c, double triangles) {
  // A surface of area A has about 3 A / voxel² triangles.
  const double voxel = std::sqrt(3 * c.area / triangles);
  polygonize::PolygonizeResult ours;
  const Measure direct = measure([&] { ours = polygonize::polygonize(*c.field, {.voxel = voxel}); });
  const Measure unprojected = measure([&] {
    polygonize::polygonize(*c.field, {.voxel = voxel, .projection = 0, .normals = false, .count_components = false});
  });

  std::optional<field::Grid> grid;
  const Measure sampling = measure([&] { grid.emplace(sampled(*c.field, voxel)); });
  openvdb::FloatGrid::Ptr vdb;
  const Measure conversion = measure([&] { vdb = to_openvdb(*grid); });
  OpenVdbMesh theirs;
  const Measure to_mesh =
      measure([&] { openvdb::tools::volumeToMesh(*vdb, theirs.points, theirs.triangles, theirs.quads, 0.0, 0.0); });
  polygonize::PolygonizeResult from_grid;
  const Measure grid_mesh = measure([&] { from_grid = polygonize::polygonize_grid(*grid); });

  const bool good = mesh::validate(ours.mesh).good() && mesh::validate(from_grid.mesh).good();
  nlohmann::json result = {{"field", c.name},
                           {"voxel", voxel},
                           {"triangles", ours.mesh.triangles.size()},
                           {"openvdb_triangles", theirs.count()},
                           {"audit_good", good},
                           {"evaluations", ours.report.evaluations},
                           {"vertices_moved", ours.report.vertices_moved},
                           {"vertices_bisected", ours.report.vertices_bisected}};
  const auto add = [&](const char* name, const Measure& m) {
    result[name] = {{"seconds", m.seconds}, {"cpu_seconds", m.cpu_seconds}, {"peak_mb", m.peak_mb}};
  };
  add("polygonize", direct);
  add("polygonize_unprojected", unprojected);
  add("sample", sampling);
  add("convert_to_openvdb", conversion);
  add("volume_to_mesh", to_mesh);
  add("polygonize_grid", grid_mesh);
  return result;
}

std::string cell(const nlohmann::json& m) {
  std::array<char, 80> text;
  std::snprintf(text.data(), text.size(), " %.3f / %.3f / %.0f |", m["seconds"].get<double>(),
                m["cpu_seconds"].get<double>(), m["peak_mb"].get<double>());
  return text.data();
}

}  // namespace

int main(int argc, char** argv) {
  std::string json;
  double triangles = 2e6;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::string(argv[i]) == "--json") json = argv[i + 1];
    if (std::string(argv[i]) == "--triangles") triangles = std::stod(argv[i + 1]);
  }
  openvdb::initialize();
  nlohmann::json all = nlohmann::json::array();
  const std::array columns = {"polygonize",         "polygonize_unprojected", "sample",
                              "convert_to_openvdb", "volume_to_mesh",         "polygonize_grid"};
  std::puts("Seconds / seconds of processor time / peak MB beyond what was there before.\n");
  std::fputs("| field | triangles |", stdout);
  for (const char* column : columns) std::printf(" %s |", column);
  std::puts("\n|---|---|---|---|---|---|---|---|");
  for (const Case& c : cases()) {
    const nlohmann::json r = run_case(c, triangles);
    all.push_back(r);
    std::printf("| %s%s | %zu |", c.name.c_str(), r["audit_good"].get<bool>() ? "" : " (audit FAILED)",
                r["triangles"].get<std::size_t>());
    for (const char* column : columns) std::fputs(cell(r[column]).c_str(), stdout);
    std::puts("");
  }
  if (!json.empty()) std::ofstream(json) << all.dump(2) << '\n';
  return 0;
}
