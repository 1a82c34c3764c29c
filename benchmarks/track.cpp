// Tracking a moving surface: time a frame and distortion of normal velocity with k rounds of fairing against blended, total
// and isometric velocities without, and against meshing every frame anew, in one run. Then scenes whose meshes must be
// mended or whose points are born: a stick through a blob and a tap from which blobs fall. Usage: bench_track [--json FILE]
// [--voxel H] [--steps N] [--scene TEXT] [--mode TEXT]: those whose names hold the text
#include <meniscus/field/blobs.h>
#include <meniscus/field/time_expression.h>
#include <meniscus/motion/tracker.h>
#include <meniscus/points/neighbours.h>
#include <meniscus/polygonize/polygonize.h>
#include <meniscus/scene/tracked_surface.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <string>

using namespace meniscus;

namespace {

field::Number moving(const char* formula) {
  return field::Number::animated(std::make_shared<field::TimeExpression>(formula));
}

struct Scene {
  std::string name;
  std::unique_ptr<field::Field> field;
  double seconds;
  bool turns;  // a full turn: every vertex should be back where it was
};

std::vector<Scene> scenes() {
  using field::Blob;
  std::vector<Scene> list;
  const Blob straight[] = {{{moving("-1+t"), moving("0.25*t"), 0.0}, 1.0}};
  list.push_back({"translating blob", field::blobs(field::BlobKernel::Compact, 0.4, straight), 2, false});
  const Blob peanut[] = {{{moving("-0.45+0.15*cos(pi*t)"), 0.0, 0.0}, 1.0},
                         {{moving("0.45-0.15*cos(pi*t)"), 0.0, 0.0}, 1.0}};
  list.push_back({"peanut, stretched", field::blobs(field::BlobKernel::Compact, 0.3, peanut), 1, false});
  const Blob orbit[] = {{{moving("1.5*cos(pi*t)"), moving("1.5*sin(pi*t)"), 0.0}, 1.0}};
  list.push_back({"orbiting blob", field::blobs(field::BlobKernel::Compact, 0.4, orbit), 2, true});
  const Blob three[] = {{{moving("0.75*cos(pi*t)"), 0.0, moving("-0.75*sin(pi*t)")}, 1.3},
                        {{moving("-0.45*cos(pi*t)+0.6*sin(pi*t)"), 0.2, moving("0.6*cos(pi*t)+0.45*sin(pi*t)")}, 1.1},
                        {{moving("-0.3*cos(pi*t)-0.55*sin(pi*t)"), -0.35, moving("-0.55*cos(pi*t)+0.3*sin(pi*t)")}, 1.2}};
  list.push_back({"three blobs turning", field::blobs(field::BlobKernel::Compact, 0.4, three), 2, true});
  return list;
}

struct Mode {
  std::string name;
  motion::Velocity velocity;
  int fairing;
};

/// Of the processor, all threads: what counts on a busy machine.
double milliseconds_since(std::clock_t start) { return 1000 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC; }

nlohmann::json run(Scene& scene, const Mode& mode, const mesh::Mesh& first, int steps) {
  field::Field& f = *scene.field;
  f.set_time(0);
  motion::TrackerOptions options;
  options.velocity.kind = mode.velocity;
  options.fairing = mode.fairing;
  motion::MeshTracker tracker(first, f, 0, options);
  const auto pose = [&](double t) -> const field::Field& {
    f.set_time(t);
    return f;
  };
  motion::StepReport last;
  double mean = 0;
  double worst = 0;
  std::size_t lost = 0;
  std::vector<double> times;
  for (int k = 1; k <= steps; ++k) {
    const auto start = std::clock();
    last = tracker.advance(pose, scene.seconds * k / steps);
    times.push_back(milliseconds_since(start));
    mean += last.area_log_mean / steps;
    worst = std::max(worst, last.area_log_max);
    lost += last.lost;
  }
  std::nth_element(times.begin(), times.begin() + steps / 2, times.end());
  double drift = 0;
  for (std::size_t i = 0; i < first.positions.size(); ++i)
    drift += (tracker.mesh().positions[i] - first.positions[i]).norm() / static_cast<double>(first.positions.size());
  nlohmann::json j{{"scene", scene.name},
                   {"mode", mode.name},
                   {"milliseconds", times[static_cast<std::size_t>(steps / 2)]},
                   {"area_log_mean", mean},
                   {"area_log_max", worst},
                   {"flips_at_end", last.flips},
                   {"lost", lost},
                   {"max_distance", last.max_distance}};
  if (scene.turns) j["drift"] = drift;
  return j;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double meshing_time(const scene::SurfaceSource& source, double voxel) {
  std::vector<double> times;
  for (const long frame : source.all_frames()) {
    const scene::Surface surface = source.open(frame);
    const auto start = std::clock();
    polygonize::polygonize(*surface.field, {.voxel = voxel, .count_components = false});
    times.push_back(milliseconds_since(start));
  }
  return median(times);
}

/// The paper's union: a mesh that is mended along the crease.
nlohmann::json run_mended(const scene::SurfaceSource& source, const Mode& mode, double voxel) {
  scene::TrackOptions options{.voxel = voxel};
  options.tracker.velocity.kind = mode.velocity;
  options.tracker.fairing = mode.fairing;
  scene::TrackedSurface surface(source, options);
  std::vector<double> step_times, frame_times;
  double mean = 0, worst = 0, carried = 0, speed = 0;
  std::size_t mended = 0, whole = 0;
  const std::vector<long> frames = source.all_frames();
  for (const long frame : frames) {
    const auto start = std::clock();
    const scene::TrackStep step = surface.go_to(frame);
    if (frame == frames.front()) continue;
    frame_times.push_back(milliseconds_since(start));
    const double count = static_cast<double>(frames.size() - 1);
    mean += step.step.area_log_mean / count;
    worst = std::max(worst, step.step.area_log_max);
    carried += static_cast<double>(step.change.carried) / static_cast<double>(surface.mesh().positions.size()) / count;
    mended += step.change.reason.empty() ? 0 : 1;
    whole += step.change.carried == 0 ? 1 : 0;
    const auto v = surface.mesh().attributes.values("v", 3);
    for (std::size_t i = 0; i < v.size(); i += 3) speed = std::max(speed, Vec3(v[i], v[i + 1], v[i + 2]).norm());
  }
  return {{"mode", mode.name},       {"milliseconds", median(frame_times)},
          {"area_log_mean", mean},   {"area_log_max", worst},
          {"frames", frames.size()}, {"mended", mended},
          {"whole", whole},          {"carried", carried},
          {"fastest", speed}};
}

/// Points from a tap: how well they cover the surface, and how many are born.
nlohmann::json run_points(const scene::SurfaceSource& source, const Mode& mode, double voxel) {
  scene::TrackOptions options{.points = true, .voxel = voxel};
  options.tracker.velocity.kind = mode.velocity;
  scene::TrackedSurface surface(source, options);
  std::vector<double> times;
  std::size_t born = 0, lost = 0, most = 0;
  double worst_gap = 0, mean_gap = 0, off = 0;
  const std::vector<long> frames = source.all_frames();
  for (const long frame : frames) {
    const auto start = std::clock();
    const scene::TrackStep step = surface.go_to(frame);
    if (frame != frames.front()) times.push_back(milliseconds_since(start));
    born += step.born;
    lost += step.step.lost;
    most = std::max(most, surface.cloud().size());
    off = std::max(off, step.step.max_distance);
    // The largest gap: from the vertices of a finer mesh of the surface to the nearest point.
    const scene::Surface now = source.open(frame);
    const mesh::Mesh fine = polygonize::polygonize(*now.field, {.voxel = voxel / 2, .count_components = false}).mesh;
    const points::NeighbourSearch search(surface.cloud().positions);
    std::vector<points::Neighbour> found;
    double gap = 0;
    for (const Vec3& p : fine.positions) {
      search.nearest(p, 1, found);
      if (!found.empty()) gap = std::max(gap, std::sqrt(found[0].squared_distance) / voxel);
    }
    worst_gap = std::max(worst_gap, gap);
    mean_gap += gap / static_cast<double>(frames.size());
  }
  return {{"mode", mode.name}, {"milliseconds", median(times)}, {"points", most},         {"born", born},
          {"lost", lost},      {"mean_gap", mean_gap},          {"worst_gap", worst_gap}, {"max_distance", off}};
}

scene::SurfaceSource scene_file(const char* name) {
  return scene::SurfaceSource({std::string(MENISCUS_SOURCE_DIR "/scenes/") + name}, {});
}

void stick(const std::string& only_mode, double voxel, nlohmann::json& all) {
  const scene::SurfaceSource source = scene_file("stick_through_blob.json");
  std::printf(
      "\n| stick through a blob | processor ms a frame, mending included | mean distortion | worst | frames mended | "
      "vertices "
      "kept | fastest |\n|---|---|---|---|---|---|---|\n| meshed anew | %.2f | | | | 0 | |\n",
      meshing_time(source, voxel));
  const Mode modes[] = {{"normal", motion::Velocity::Normal, 0},
                        {"normal + 50", motion::Velocity::Normal, 50},
                        {"blended", motion::Velocity::Blended, 0},
                        {"total", motion::Velocity::Total, 0},
                        {"isometric", motion::Velocity::Isometric, 0}};
  for (const Mode& mode : modes) {
    if (mode.name.find(only_mode) == std::string::npos) continue;
    nlohmann::json r = run_mended(source, mode, voxel);
    r["scene"] = "stick through a blob";
    std::printf("| %s | %.2f | %.3f | %.2f | %zu of %zu | %.1f %% | %.2f |\n", mode.name.c_str(),
                r["milliseconds"].get<double>(), r["area_log_mean"].get<double>(), r["area_log_max"].get<double>(),
                r["mended"].get<std::size_t>(), r["frames"].get<std::size_t>() - 1, 100 * r["carried"].get<double>(),
                r["fastest"].get<double>());
    std::fflush(stdout);
    all.push_back(std::move(r));
  }
}

void emitter(const std::string& only_mode, double voxel, nlohmann::json& all) {
  const scene::SurfaceSource source = scene_file("falling_blobs.json");
  std::printf(
      "\n| falling blobs, as points | processor ms a frame | most points | born | lost | largest gap, spacings: mean | "
      "worst | off "
      "the surface |\n|---|---|---|---|---|---|---|---|\n| meshed anew | %.2f | | | | | | |\n",
      meshing_time(source, voxel));
  const Mode modes[] = {{"normal", motion::Velocity::Normal, 0},
                        {"blended", motion::Velocity::Blended, 0},
                        {"total", motion::Velocity::Total, 0},
                        {"isometric", motion::Velocity::Isometric, 0}};
  for (const Mode& mode : modes) {
    if (mode.name.find(only_mode) == std::string::npos) continue;
    nlohmann::json r = run_points(source, mode, voxel);
    r["scene"] = "falling blobs";
    std::printf("| %s | %.2f | %zu | %zu | %zu | %.2f | %.2f | %.1e |\n", mode.name.c_str(), r["milliseconds"].get<double>(),
                r["points"].get<std::size_t>(), r["born"].get<std::size_t>(), r["lost"].get<std::size_t>(),
                r["mean_gap"].get<double>(), r["worst_gap"].get<double>(), r["max_distance"].get<double>());
    std::fflush(stdout);
    all.push_back(std::move(r));
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::string json;
  double voxel = 0.05;
  int steps = 48;
  std::string only_scene;
  std::string only_mode;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::string(argv[i]) == "--json") json = argv[i + 1];
    if (std::string(argv[i]) == "--voxel") voxel = std::stod(argv[i + 1]);
    if (std::string(argv[i]) == "--steps") steps = std::stoi(argv[i + 1]);
    if (std::string(argv[i]) == "--scene") only_scene = argv[i + 1];
    if (std::string(argv[i]) == "--mode") only_mode = argv[i + 1];
  }
  const Mode modes[] = {{"normal", motion::Velocity::Normal, 0},         {"normal + 5", motion::Velocity::Normal, 5},
                        {"normal + 10", motion::Velocity::Normal, 10},   {"normal + 20", motion::Velocity::Normal, 20},
                        {"normal + 50", motion::Velocity::Normal, 50},   {"normal + 200", motion::Velocity::Normal, 200},
                        {"normal + 500", motion::Velocity::Normal, 500}, {"blended", motion::Velocity::Blended, 0},
                        {"total", motion::Velocity::Total, 0},           {"isometric", motion::Velocity::Isometric, 0}};
  nlohmann::json all = nlohmann::json::array();
  std::puts(
      "| scene | mode | processor ms a frame (median) | mean distortion | worst | flips | lost | drift "
      "|\n|---|---|---|---|---|---|---|---|");
  for (Scene& scene : scenes()) {
    if (scene.name.find(only_scene) == std::string::npos) continue;
    scene.field->set_time(0);
    const auto start = std::clock();
    mesh::Mesh first = polygonize::polygonize(*scene.field, {.voxel = voxel, .count_components = false}).mesh;
    const double meshing = milliseconds_since(start);
    motion::fair(*scene.field, first, 10);
    std::printf("| %s, %zu triangles | meshed anew | %.2f | | | | | |\n", scene.name.c_str(), first.triangles.size(),
                meshing);
    all.push_back(
        {{"scene", scene.name}, {"mode", "meshed anew"}, {"milliseconds", meshing}, {"triangles", first.triangles.size()}});
    for (const Mode& mode : modes) {
      if (mode.name.find(only_mode) == std::string::npos) continue;
      const nlohmann::json r = run(scene, mode, first, steps);
      all.push_back(r);
      std::array<char, 32> drift_text{};
      if (r.contains("drift")) std::snprintf(drift_text.data(), drift_text.size(), "%.2e", r["drift"].get<double>());
      std::printf("| | %s | %.2f | %.2e | %.2e | %zu | %zu | %s |\n", mode.name.c_str(), r["milliseconds"].get<double>(),
                  r["area_log_mean"].get<double>(), r["area_log_max"].get<double>(), r["flips_at_end"].get<std::size_t>(),
                  r["lost"].get<std::size_t>(), drift_text.data());
      std::fflush(stdout);
    }
  }
  if (std::string("stick through a blob").find(only_scene) != std::string::npos) stick(only_mode, voxel, all);
  if (std::string("falling blobs").find(only_scene) != std::string::npos) emitter(only_mode, voxel, all);
  if (!json.empty()) std::ofstream(json) << all.dump(2) << '\n';
  return 0;
}
