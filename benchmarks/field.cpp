// How many points a second do fields evaluate, by family and derivative order? And does a sum of local blobs cost what
// reaches the point, whatever their number? One thread, so figures scale with cores.
// Usage: bench_field [--json FILE]
#include "support/measure.h"

#include <meniscus/base/random.h>
#include <meniscus/field/blobs.h>
#include <meniscus/field/combine.h>
#include <meniscus/field/expression.h>
#include <meniscus/field/primitives.h>
#include <meniscus/field/transform.h>

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>

using namespace meniscus;
using namespace meniscus::field;

namespace {

constexpr Order kOrders[] = {Order::Value, Order::Gradient, Order::GradientTime, Order::Hessian, Order::HessianTime};

Vec3 random_point(std::uint64_t id, double half) {
  const auto u = random_uniform(1, id, 0);
  return half * Vec3(2 * u[0] - 1, 2 * u[1] - 1, 2 * u[2] - 1);
}

/// Blobs of equal density whatever their number: each point is reached by about 30.
std::unique_ptr<Field> compact_blobs(std::size_t n) {
  const double half = std::cbrt(static_cast<double>(n)) * 0.5;
  std::vector<Vec3> centers;
  for (std::size_t i = 0; i < n; ++i) centers.push_back(random_point(i, half));
  const double radius[] = {0.96};
  return particles(centers, radius);
}

/// Points in small clusters, as surface samples in spatial order are.
PositionBatch clustered(std::size_t n, double half) {
  PositionBatch x(n);
  for (std::size_t i = 0; i < n; ++i) x.set(i, random_point(1000 + i / 256, 0.8 * half) + random_point(i, 0.5));
  return x;
}

double points_per_second(const Field& f, const PositionBatch& x, Order order) {
  JetBatch out(kBlock, order);
  const auto once = [&] {
    for (std::size_t b = 0; b < x.view().size; b += kBlock) f.evaluate(x.view().part(b, kBlock), out.view());
  };
  return static_cast<double>(x.view().size) / bench::measure_repeated(once).cpu_seconds;
}

template <class... F>
Inputs inputs(F... fields) {
  Inputs list;
  (list.push_back(std::move(fields)), ...);
  return list;
}

}  // namespace

int main(int argc, char** argv) {
  nlohmann::json report = nlohmann::json::array();
  std::printf("Million points per second and thread (processor time).\n\n");
  std::printf("| field | F | F, ∇F | and F_t | F, ∇F, H | all 14 |\n|---|---|---|---|---|---|\n");
  const auto row = [&](const std::string& name, const Field& f, const PositionBatch& x) {
    std::printf("| %s |", name.c_str());
    nlohmann::json entry{{"field", name}};
    for (const Order o : kOrders) {
      const double rate = points_per_second(f, x, o) / 1e6;
      entry["orders"].push_back(rate);
      std::printf(" %.3g |", rate);
    }
    std::printf("\n");
    report.push_back(entry);
  };

  const PositionBatch x = clustered(16 * kBlock, 1);
  row("sphere", *sphere({0, 0, 0}, 1), x);
  row("box", *box({0, 0, 0}, {1, 1, 1}), x);
  row("torus", *torus({0, 0, 0}, {0, 1, 0}, 1, 0.3), x);
  row("capsule", *capsule({0, 0, 0}, {1, 0, 0}, 0.3), x);
  row("plane", *plane({0, 0, 0}, {0, 1, 0}), x);
  row("ellipsoid", *ellipsoid({0, 0, 0}, {1, 0.8, 0.6}), x);
  row("union of two spheres", *set_union(inputs(sphere({0, 0, 0}, 1), sphere({1, 0, 0}, 1))), x);
  row("blend of two spheres", *blend(inputs(sphere({0, 0, 0}, 1), sphere({1, 0, 0}, 1)), 0.5), x);
  row("transformed torus", *transform(torus({0, 0, 0}, {0, 1, 0}, 1, 0.3), {1, 0, 0}, {0, 30, 0}, 1.5), x);
  row("expression: gyroid", Expression("sin(x)*cos(y)+sin(y)*cos(z)+sin(z)*cos(x)"), x);
  std::vector<Blob> three;
  for (std::size_t i = 0; i < 3; ++i) three.push_back({{0.5 * static_cast<double>(i), 0, 0}, 0.7, 1});
  row("3 Gaussian blobs", *blobs(BlobKernel::Gaussian, 0.35, three), x);
  for (const std::size_t n : {1'000u, 10'000u, 100'000u})
    row(std::to_string(n) + " compact blobs, 30 reach a point", *compact_blobs(n),
        clustered(16 * kBlock, std::cbrt(static_cast<double>(n)) * 0.5));

  for (int i = 1; i + 1 < argc; ++i)
    if (std::string(argv[i]) == "--json") std::ofstream(argv[i + 1]) << report.dump(2) << "\n";
}
