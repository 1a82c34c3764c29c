// Even points on an implicit surface, from nothing: spread() against CGAL make_surface_mesh on the same functions in one
// run. A step of floaters: neighbour grid against all pairs, and how it grows with their number, on 2 and on 1,000 blobs.
// Usage: bench_sample [--json FILE] [--points N] [--full] [--steps]
//        --full: a million floaters too; --steps: floaters alone
//        bench_sample --seeds N [--mesh FILE]: evenness alone, the worst of N seeds on each surface and on a mesh
#include <meniscus/base/random.h>
#include <meniscus/field/blobs.h>
#include <meniscus/field/expression.h>
#include <meniscus/field/primitives.h>
#include <meniscus/sample/floaters.h>
#include <meniscus/sample/repulsion.h>
#include <meniscus/sample/spread.h>
#include <meniscus/scene/file_field.h>

#include <CGAL/Complex_2_in_triangulation_3.h>
#include <CGAL/Implicit_surface_3.h>
#include <CGAL/Surface_mesh_default_triangulation_3.h>
#include <CGAL/make_surface_mesh.h>
#include <nlohmann/json.hpp>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fstream>
#include <numeric>
#include <string>

using namespace meniscus;

namespace {

struct Time {
  double seconds = 0;
  double cpu_seconds = 0;  // of all threads: what counts on a busy machine
};

template <class Work>
Time measure(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpu = std::clock();
  work();
  const double taken = static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC;
  return {std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), taken};
}

struct Case {
  std::string name;
  std::unique_ptr<field::Field> field;
};

std::vector<Case> shapes() {
  std::vector<Case> list;
  list.push_back({"sphere", field::sphere({0.0, 0.0, 0.0}, 1.0)});
  list.push_back({"torus", field::torus({0.0, 0.0, 0.0}, {0.0, 0.0, 1.0}, 1.0, 0.4)});
  const field::Blob items[] = {{{-0.6, 0.0, 0.0}, 0.6}, {{0.6, 0.0, 0.0}, 0.6}, {{0.0, 0.8, 0.1}, 0.6}};
  list.push_back({"three blobs", field::blobs(field::BlobKernel::Gaussian, 0.35, items)});
  return list;
}

// ---- against CGAL ----

using Triangulation = CGAL::Surface_mesh_default_triangulation_3;
using Kernel = Triangulation::Geom_traits;

/// The same analytic function as a plain C++ function: CGAL asks for one point at a time.
double plain(const std::string& name, double x, double y, double z) {
  if (name == "sphere") return std::sqrt(x * x + y * y + z * z) - 1;
  if (name == "torus") {
    const double q = std::sqrt(x * x + y * y) - 1;
    return std::sqrt(q * q + z * z) - 0.4;
  }
  const double c[3][3] = {{-0.6, 0, 0}, {0.6, 0, 0}, {0, 0.8, 0.1}};
  double f = 0.35;
  for (const auto& p : c)
    f -= std::exp(-((x - p[0]) * (x - p[0]) + (y - p[1]) * (y - p[1]) + (z - p[2]) * (z - p[2])) / 0.36);
  return f;
}

sample::SurfacePoints cgal_points(const std::string& name, double spacing) {
  using Function = std::function<Kernel::FT(Kernel::Point_3)>;
  Function f = [&](const Kernel::Point_3& p) { return plain(name, p.x(), p.y(), p.z()); };
  const double cx = name == "torus" ? 1.0 : name == "sphere" ? 0.0 : 0.6;  // inside
  CGAL::Implicit_surface_3<Kernel, Function> surface(f, Kernel::Sphere_3({cx, 0, 0}, 9.0), 1e-6);
  Triangulation triangulation;
  CGAL::Complex_2_in_triangulation_3<Triangulation> complex(triangulation);
  // A radius bound of the hexagonal circumradius gives roughly the wanted number.
  const double radius = spacing / std::sqrt(3.0) * 1.35;
  CGAL::make_surface_mesh(complex, surface, CGAL::Surface_mesh_default_criteria_3<Triangulation>(30, radius, radius),
                          CGAL::Manifold_tag());
  sample::SurfacePoints points;
  for (auto v = triangulation.finite_vertices_begin(); v != triangulation.finite_vertices_end(); ++v)
    points.push_back({v->point().x(), v->point().y(), v->point().z()}, Vec3::UnitZ());
  return points;
}

/// Judges any points by the measure of ours.
sample::Evenness judged(const field::Field& f, const Box& box, sample::SurfacePoints points, double area) {
  const field::JetBatch jets = [&] {
    field::JetBatch j(points.size(), field::Order::Gradient);
    field::evaluate(f, points.positions(), j.view(), {});
    return j;
  }();
  for (std::size_t i = 0; i < points.size(); ++i) points.set_normal(i, jets.gradient(i).normalized());
  const double spacing = sample::hexagonal_spacing(area, static_cast<double>(points.size()));
  return sample::evenness(f, box, points, std::vector<double>(points.size(), spacing));
}

nlohmann::json even_points(double count) {
  std::printf(
      "## Even points from nothing\n\n| surface | sampler | points | s | CPU s | points/s | per CPU s | CGAL by wall clock "
      "| "
      "by CPU | packing | cover | cv |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  nlohmann::json rows;
  // Rates are given in those of CGAL on the same surface; `theirs` is its time for one point.
  const auto row = [&](const Case& c, const char* who, const Time& t, const Time& theirs, const sample::Evenness& e) {
    const double n = static_cast<double>(e.count);
    std::printf("| %s | %s | %zu | %.2f | %.2f | %.0f | %.0f | %.1f | %.1f | %.3f | %.3f | %.3f |\n", c.name.c_str(), who,
                e.count, t.seconds, t.cpu_seconds, n / t.seconds, n / t.cpu_seconds, n / t.seconds * theirs.seconds,
                n / t.cpu_seconds * theirs.cpu_seconds, e.packing, e.cover, e.cv);
    rows.push_back({{"surface", c.name},
                    {"sampler", who},
                    {"points", e.count},
                    {"seconds", t.seconds},
                    {"cpu_seconds", t.cpu_seconds},
                    {"packing", e.packing},
                    {"cover", e.cover},
                    {"cv", e.cv}});
  };
  const Box box = Box::around(Vec3::Zero(), 1.7);
  for (const Case& c : shapes()) {
    sample::Sampling ours[2];
    Time taken[2];
    for (const bool fast : {false, true})
      taken[fast] = measure(
          [&] { ours[fast] = sample::spread(*c.field, box, {.count = static_cast<std::size_t>(count), .fast = fast}); });
    sample::SurfacePoints points;
    const Time t = measure([&] { points = cgal_points(c.name, ours[0].report.spacing); });
    const double n = static_cast<double>(points.size());
    const Time each{t.seconds / n, t.cpu_seconds / n};
    row(c, "meniscus", taken[0], each, ours[0].report.evenness);
    row(c, "meniscus --fast", taken[1], each, ours[1].report.evenness);
    row(c, "CGAL make_surface_mesh", t, each, judged(*c.field, box, std::move(points), ours[0].report.evenness.area));
  }
  std::printf("\n");
  return rows;
}

// ---- evenness over seeds ----

struct EvenCase {
  std::string name;
  std::unique_ptr<field::Field> field;
  Box box;
  std::vector<std::size_t> counts;
};

std::vector<EvenCase> even_cases(const std::string& mesh) {
  std::vector<EvenCase> list;
  for (Case& c : shapes()) list.push_back({c.name, std::move(c.field), Box::around(Vec3::Zero(), 1.7), {1000, 5000, 20000}});
  list.front().counts = {100, 500, 1000};
  list.push_back({"gyroid patch",
                  std::make_unique<field::Expression>("sin(3*x)*cos(3*y) + sin(3*y)*cos(3*z) + sin(3*z)*cos(3*x)"),
                  Box::around(Vec3::Zero(), 1),
                  {1000, 5000, 20000}});
  if (mesh.empty()) return list;
  auto surface = scene::field_from_mesh(mesh, {}, {});
  const Box bounds = surface->bounds();
  list.push_back({"mesh", std::move(surface), bounds.padded(0.02 * bounds.diameter()), {5000, 10000, 20000, 50000, 100000}});
  return list;
}

nlohmann::json even_over_seeds(int seeds, const std::string& mesh) {
  std::printf(
      "## The worst of %d seeds\n\n| surface | points | packing | cover | cv | not the count | CPU µs per point "
      "|\n|---|---|---|---|---|---|---|\n",
      seeds);
  nlohmann::json rows;
  for (const EvenCase& c : even_cases(mesh))
    for (const std::size_t count : c.counts) {
      double packing = 1e9, cover = 0, cv = 0, cpu = 0;
      int missed = 0;
      for (int seed = 0; seed < seeds; ++seed) {
        sample::SpreadReport r;
        const RunControl run({.threads = {}, .seed = static_cast<std::uint64_t>(seed), .on_progress = {}});
        cpu += measure([&] { r = sample::spread(*c.field, c.box, {.count = count}, run).report; }).cpu_seconds;
        packing = std::min(packing, r.evenness.packing);
        cover = std::max(cover, r.evenness.cover);
        cv = std::max(cv, r.evenness.cv);
        missed += r.evenness.count != count;
      }
      const double micro = 1e6 * cpu / seeds / static_cast<double>(count);
      std::printf("| %s | %zu | %.3f | %.3f | %.3f | %d | %.0f |\n", c.name.c_str(), count, packing, cover, cv, missed,
                  micro);
      std::fflush(stdout);
      rows.push_back({{"surface", c.name}, {"points", count}, {"packing", packing}, {"cover", cover}, {"cv", cv}});
    }
  return rows;
}

// ---- steps ----

std::unique_ptr<field::Field> blob_scene(std::size_t blobs) {
  if (blobs == 2) {
    const field::Blob two[] = {{{-0.5, 0.0, 0.0}, 0.8}, {{0.5, 0.0, 0.0}, 0.8}};
    return field::blobs(field::BlobKernel::Gaussian, 0.35, two);
  }
  std::vector<field::Blob> items;
  for (std::size_t i = 0; i < blobs; ++i) {
    const auto u = random_uniform(5, i, 0);
    items.push_back({{2 * u[0] - 1, 2 * u[1] - 1, 2 * u[2] - 1}, 0.12});
  }
  return field::blobs(field::BlobKernel::Gaussian, 0.35, items);
}

/// One step of repulsion as written in the paper: every particle against every other, one thread. Measured on a part of the
/// particles when they are many, and scaled.
double all_pairs_seconds(const sample::Floaters& f) {
  std::vector<std::uint32_t> all(f.size());
  std::iota(all.begin(), all.end(), 0U);
  const std::size_t probe = std::min<std::size_t>(f.size(), 200);
  double sink = 0;
  const Time t = measure([&] {
    for (std::size_t i = 0; i < probe; ++i) {
      const Vec3 p = f.points().position(i);
      const double s2 = 2 * f.radii()[i] * f.radii()[i];
      Vec3 sum = Vec3::Zero();
      for (std::size_t j = 0; j < f.size(); ++j) {
        const Vec3 r = p - f.points().position(j);
        const double r2 = r.squaredNorm(), ratio = f.radii()[i] / f.radii()[j];
        sum += (6 * std::exp(-r2 / s2) + ratio * ratio * 6 * std::exp(-r2 / (2 * f.radii()[j] * f.radii()[j]))) * r;
      }
      sink += sum.x();
    }
  });
  if (sink == 1.5) std::printf(" ");  // keeps the work
  return t.cpu_seconds * static_cast<double>(f.size()) / static_cast<double>(probe);
}

nlohmann::json steps(bool full) {
  std::printf(
      "## Steps of floaters at rest\n\n| blobs | floaters | steps/s | steps per CPU s | ns per floater (CPU) | all pairs, 1 "
      "thread, s per step | resident bytes per floater |\n|---|---|---|---|---|---|---|\n");
  nlohmann::json rows;
  for (const std::size_t blobs : {std::size_t{2}, std::size_t{1000}}) {
    const auto scene = blob_scene(blobs);
    const Box box = Box::around(Vec3::Zero(), 2);
    const double area = sample::spread(*scene, box, {.spacing = 0.05, .fast = true}).report.evenness.area;
    for (const double n : {1e3, 1e4, 1e5, 1e6}) {
      if (n > 2e5 && !full) continue;
      // Started from an even sampling: the spreading itself is another question.
      const sample::Sampling start = sample::spread(*scene, box, {.count = static_cast<std::size_t>(n), .fast = true});
      const double radius = std::sqrt(area / n / 3.523);
      sample::Floaters f(box, {.radius = 1.3 * radius, .search_interval = 0});
      const auto normals = start.cloud.attributes.values(attribute::kNormal, 3);
      for (std::size_t i = 0; i < start.cloud.size(); ++i)
        f.add(start.cloud.positions[i], {normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]}, radius);
      for (int k = 0; k < 3; ++k) f.step(*scene);
      const int repeats = n < 5e4 ? 50 : 10;
      const Time t = measure([&] {
        for (int k = 0; k < repeats; ++k) f.step(*scene);
      });
      const double pairs = all_pairs_seconds(f), size = static_cast<double>(f.size());
      std::printf("| %zu | %zu | %.1f | %.1f | %.0f | %.3g | %zu |\n", blobs, f.size(), repeats / t.seconds,
                  repeats / t.cpu_seconds, 1e9 * t.cpu_seconds / repeats / size, pairs, f.bytes() / f.size());
      std::fflush(stdout);
      rows.push_back({{"blobs", blobs},
                      {"floaters", f.size()},
                      {"steps_per_second", repeats / t.seconds},
                      {"cpu_ns_per_floater", 1e9 * t.cpu_seconds / repeats / size},
                      {"all_pairs_seconds", pairs},
                      {"bytes_per_floater", f.bytes() / f.size()}});
    }
  }
  return rows;
}

}  // namespace

int main(int argc, char** argv) {
  double points = 20000;
  bool full = false, only_steps = false;
  int seeds = 0;
  std::string json, mesh;
  for (int i = 1; i < argc; ++i) {
    if (i + 1 < argc && std::strcmp(argv[i], "--seeds") == 0) seeds = std::stoi(argv[i + 1]);
    if (i + 1 < argc && std::strcmp(argv[i], "--mesh") == 0) mesh = argv[i + 1];
    if (std::strcmp(argv[i], "--full") == 0) full = true;
    if (std::strcmp(argv[i], "--steps") == 0) only_steps = true;
    if (i + 1 < argc && std::strcmp(argv[i], "--points") == 0) points = std::stod(argv[i + 1]);
    if (i + 1 < argc && std::strcmp(argv[i], "--json") == 0) json = argv[i + 1];
  }
  nlohmann::json out;
  if (seeds > 0) {
    out["even_over_seeds"] = even_over_seeds(seeds, mesh);
  } else {
    if (!only_steps) out["even_points"] = even_points(points);
    out["steps"] = steps(full);
  }
  if (!json.empty()) std::ofstream(json) << out.dump(2) << "\n";
}
