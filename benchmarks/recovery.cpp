// A cylinder is stretched fourfold in one step: how long until packing is back above 0.8? Floaters with a radius of their
// own, with momentum (our default) and without (the paper), against one radius for all. [WH94, figures 1-3] Usage:
// bench_recovery [--json FILE] [--radius R]
#include <meniscus/field/primitives.h>
#include <meniscus/sample/floaters.h>
#include <meniscus/sample/spread.h>

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fstream>
#include <string>

using namespace meniscus;

namespace {

std::unique_ptr<field::Field> cylinder(double length) {
  return field::capsule({-0.5 * length, 0.0, 0.0}, {0.5 * length, 0.0, 0.0}, 0.4);
}

struct Recovery {
  int steps_to_cover = -1;    // no empty circle above twice the lattice's
  int steps_to_packing = -1;  // packing above the wanted one
  double cpu_seconds = 0;
  std::size_t before = 0, after = 0;
  double packing = 0, cover = 0;
};

Recovery recover(const sample::FloaterOptions& options, double wanted) {
  const Box box = Box::around(Vec3::Zero(), 3);
  const auto small = cylinder(1), large = cylinder(4);
  sample::Floaters f(box, options);
  f.settle(*small, 600);
  Recovery r;
  r.before = f.size();
  // The particles ride along: the surface is stretched, and they with it.
  sample::Floaters g(box, options);
  for (std::size_t i = 0; i < f.size(); ++i) {
    Vec3 p = f.points().position(i);
    p.x() *= 4;
    g.add(p, f.points().normal(i), f.radii()[i]);
  }
  double cpu = 0;
  for (int k = 1; k <= 600; ++k) {
    const std::clock_t start = std::clock();
    g.step(*large);
    cpu += static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    if (k % 2 != 0) continue;
    const sample::Evenness e = g.measured(*large);
    if (r.steps_to_cover < 0 && e.cover < 2) r.steps_to_cover = k;
    r.packing = std::max(r.packing, e.packing);
    r.cover = e.cover;
    if (e.packing < wanted || e.cover > 2) continue;
    r.steps_to_packing = k;
    break;
  }
  r.cpu_seconds = cpu;
  r.after = g.size();
  return r;
}

}  // namespace

int main(int argc, char** argv) {
  double radius = 0.06;
  std::string json;
  for (int i = 1; i + 1 < argc; ++i) {
    if (std::strcmp(argv[i], "--radius") == 0) radius = std::stod(argv[i + 1]);
    if (std::strcmp(argv[i], "--json") == 0) json = argv[i + 1];
  }
  std::printf(
      "| radii | floaters before | after | steps until covered | steps until packing 0.8 | best packing | cover | CPU s "
      "|\n|---|---|---|---|---|---|---|---|\n");
  nlohmann::json rows;
  using Method = sample::FloaterOptions::Method;
  const struct {
    const char* name;
    sample::FloaterOptions options;
  } ways[] = {{"adaptive", {.radius = radius, .search_interval = 0}},
              {"adaptive, no momentum", {.radius = radius, .momentum = 0, .search_interval = 0}},
              {"global", {.radius = radius, .method = Method::Global, .search_interval = 0}}};
  for (const auto& [name, options] : ways) {
    const Recovery r = recover(options, 0.8);
    std::printf("| %s | %zu | %zu | %d | %d | %.3f | %.3f | %.2f |\n", name, r.before, r.after, r.steps_to_cover,
                r.steps_to_packing, r.packing, r.cover, r.cpu_seconds);
    rows.push_back({{"radii", name},
                    {"steps_to_cover", r.steps_to_cover},
                    {"steps_to_packing", r.steps_to_packing},
                    {"packing", r.packing},
                    {"cover", r.cover},
                    {"cpu_seconds", r.cpu_seconds}});
  }
  if (!json.empty()) std::ofstream(json) << rows.dump(2) << "\n";
}
