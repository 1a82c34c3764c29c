// Tracking a moving surface: time a frame and distortion of normal velocity with k rounds of fairing against blended, total
// and isometric velocities without, and against meshing every frame anew, in one run.
// Usage: bench_track [--json FILE] [--voxel H] [--steps N] [--scene TEXT] [--mode TEXT]: those whose names hold the text
#include <meniscus/field/blobs.h>
#include <meniscus/field/time_expression.h>
#include <meniscus/motion/tracker.h>
#include <meniscus/polygonize/polygonize.h>

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
  const Mode modes[] = {{"normal", motion::Velocity::Normal, 0},       {"normal + 5", motion::Velocity::Normal, 5},
                        {"normal + 10", motion::Velocity::Normal, 10}, {"normal + 20", motion::Velocity::Normal, 20},
                        {"normal + 50", motion::Velocity::Normal, 50}, {"blended", motion::Velocity::Blended, 0},
                        {"total", motion::Velocity::Total, 0},         {"isometric", motion::Velocity::Isometric, 0}};
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
  if (!json.empty()) std::ofstream(json) << all.dump(2) << '\n';
  return 0;
}
