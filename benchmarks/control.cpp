// Control points: the time of one solve and of one step of a drag, and what drags do to surfaces.
// Usage: bench_control [--json FILE]
#include <meniscus/base/random.h>
#include <meniscus/control/drag.h>
#include <meniscus/control/system.h>
#include <meniscus/field/blobs.h>
#include <meniscus/scene/edit_session.h>

#include "tests/support/drag_suite.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <string>

using namespace meniscus;

namespace {

struct Measure {
  double ms = 0, cpu_ms = 0;  // median
};

template <class Work>
Measure median_of(int repeats, const Work& work) {
  std::vector<double> wall, cpu;
  for (int i = 0; i < repeats; ++i) {
    const auto w = std::chrono::steady_clock::now();
    const auto c = std::clock();
    work();
    wall.push_back(1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - w).count());
    cpu.push_back(1e3 * static_cast<double>(std::clock() - c) / CLOCKS_PER_SEC);
  }
  std::sort(wall.begin(), wall.end());
  std::sort(cpu.begin(), cpu.end());
  return {wall[wall.size() / 2], cpu[cpu.size() / 2]};
}

control::System dense_system(std::size_t parameters, std::size_t controls) {
  control::System s;
  for (std::size_t i = 0; i < controls; ++i) {
    for (std::size_t k = 0; k < parameters; ++k) {
      s.rows.index.push_back(static_cast<std::uint32_t>(k));
      s.rows.value.push_back(2 * random_uniform(1, i, k)[0] - 1);
    }
    s.rows.begin.push_back(s.rows.index.size());
    s.target.push_back(random_uniform(2, i, 0)[0]);
  }
  s.scale.assign(parameters, 1.0);
  return s;
}

/// A slab of compact blobs on a jittered grid; four free numbers each (the weights stay).
std::unique_ptr<field::Field> slab(int side, int height) {
  std::vector<field::Blob> items;
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j)
      for (int k = 0; k < height; ++k) {
        const auto u = random_uniform(3, static_cast<std::uint64_t>(items.size()), 0);
        items.push_back({{field::Number(i + 0.2 * u[0]), field::Number(k + 0.2 * u[1]), field::Number(j + 0.2 * u[2])},
                         field::Number(1.6),
                         field::Number::frozen(1)});
      }
  return field::blobs(field::BlobKernel::Compact, field::Number::frozen(0.4), items);
}

/// A session with `count` controls spread over the top of the slab, every second one to be lifted.
std::vector<Vec3> tops(const field::Field& f, int side, std::size_t count) {
  std::vector<Vec3> points;
  for (std::uint64_t i = 0; points.size() < count; ++i) {
    const auto u = random_uniform(4, i, 0);
    const Vec3 above((side - 1) * u[0], 100, (side - 1) * u[1]);
    for (double y = 12; y > 0; y -= 0.25) {
      const Vec3 p(above.x(), y, above.z());
      if (field::value_at(f, p) > 0) continue;
      if (const auto on = control::nearest_surface_point(f, p, 1)) points.push_back(*on);
      break;
    }
  }
  return points;
}

/// Waves half a unit high: the drag of many controls at once.
double lift(const Vec3& p) { return 0.25 * (1 + std::sin(0.4 * p.x()) * std::cos(0.4 * p.z())); }

void report(nlohmann::json& all, const std::string& what, const Measure& m, double aim_ms, const std::string& note) {
  std::printf("| %s | %.3g | %.3g | %.3g | %s |\n", what.c_str(), m.ms, m.cpu_ms, aim_ms, note.c_str());
  std::fflush(stdout);
  all.push_back({{"case", what}, {"ms", m.ms}, {"cpu_ms", m.cpu_ms}, {"aim_ms", aim_ms}, {"note", note}});
}

/// One Newton step's rows and solve on a large local model.
void local_model(nlohmann::json& all, int side, int height, std::size_t count, double aim) {
  const auto f = slab(side, height);
  const std::vector<Vec3> points = tops(*f, side, count);
  const std::string name =
      std::to_string(f->parameters().size()) + " parameters of local blobs, " + std::to_string(count) + " controls";
  const auto rows = control::surface_rows(*f, points, 1);
  control::System s;
  s.rows = rows.rows;
  s.scale.assign(f->parameters().size(), 1.0);
  for (std::size_t i = 0; i < count; ++i) s.target.push_back(i % 2 == 0 ? 0.01 : 0.0);
  control::Solution x;
  const Measure solving = median_of(7, [&] { x = control::solve(s); });
  report(all, name + ": solve", solving, aim, "rank " + std::to_string(x.rank) + ", " + control::name(x.status));

  control::ControlSession session(*f);
  for (const Vec3& p : points) session.add(p);
  for (std::size_t i = 0; i < count; ++i) session.aim(i, points[i] + Vec3(0, lift(points[i]), 0));
  control::StepReport step;
  const Measure stepping = median_of(21, [&] { step = session.step(1 / 60.0); });
  report(all, name + ": full step", stepping, aim,
         std::to_string(step.newton_steps) + " Newton steps, rank " + std::to_string(step.rank) + ", " +
             control::name(step.outcome));
}

/// The loop of an interface: 20 controls pull on 100 unknowns, 10,000 floaters follow.
void with_floaters(nlohmann::json& all) {
  std::string items;
  for (int i = 0; i < 25; ++i)
    items += std::string(i > 0 ? "," : "") + "{\"center\":[" + std::to_string(i % 5) + "," + std::to_string(0.1 * (i % 3)) +
             "," + std::to_string(i / 5) + R"(],"radius":1.6,"weight":1})";
  std::string freeze;
  for (int i = 0; i < 25; ++i) freeze += ",\"items[" + std::to_string(i) + "].weight\"";
  scene::EditSession session(scene::Document::parse(
      R"({"format":"meniscus.scene","version":1,"surface":{"type":"blobs","kernel":"compact","bias":0.4,"freeze":["bias")" +
          freeze + R"(],"items":[)" + items + "]}}",
      "blobs.json"));
  session.show_floaters(10000);
  control::ControlSession& controls = session.begin_stroke();
  for (const Vec3& p : tops(session.surface(), 5, 20)) {
    const std::size_t id = controls.add(p).id;
    controls.aim(id, controls.controls()[id].position + Vec3(0, 2 * lift(p), 0));
  }
  scene::EditStep step;
  const Measure m = median_of(48, [&] { step = session.step(1 / 60.0); });
  report(all, "100 parameters, 20 controls, 10,000 floaters: full step", m, 16,
         std::to_string(session.floaters()->size()) + " floaters, rank " + std::to_string(step.control.rank) + ", " +
             control::name(step.control.outcome));
}

/// Jumps, flips and hysteresis of a scripted drag on four surfaces.
void drag_suite(nlohmann::json& all) {
  std::printf(
      "\n| drag there and back | steps | largest jump / hand | flips | failed | hysteresis |\n|---|---|---|---|---|---|\n");
  for (test::DragScene& scene : test::drag_scenes()) {
    const test::DragMeasure m = test::drag_around(scene, 1);
    std::printf("| %s | %zu | %.2f | %zu | %zu | %.1e |\n", scene.name.c_str(), m.steps, m.jump, m.flips, m.failed,
                m.hysteresis);
    all.push_back({{"case", scene.name},
                   {"steps", m.steps},
                   {"jump", m.jump},
                   {"flips", m.flips},
                   {"failed", m.failed},
                   {"hysteresis", m.hysteresis}});
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::string json;
  for (int i = 1; i + 1 < argc; ++i)
    if (std::string(argv[i]) == "--json") json = argv[i + 1];
  nlohmann::json all = nlohmann::json::array();
  std::printf("| case | ms | CPU ms | aim ms | |\n|---|---|---|---|---|\n");
  for (const auto& [m, n, aim] : {std::tuple{100, 20, 1.0}, std::tuple{400, 100, 10.0}}) {
    const control::System s = dense_system(static_cast<std::size_t>(m), static_cast<std::size_t>(n));
    control::Solution x;
    const Measure t = median_of(21, [&] { x = control::solve(s); });
    report(all, std::to_string(m) + " parameters, " + std::to_string(n) + " controls, dense: solve", t, aim,
           "rank " + std::to_string(x.rank));
  }
  local_model(all, 5, 1, 20, 1);
  local_model(all, 10, 1, 100, 10);
  local_model(all, 50, 4, 1000, 50);
  with_floaters(all);
  drag_suite(all);
  if (!json.empty()) std::ofstream(json) << all.dump(1) << '\n';
  return 0;
}
