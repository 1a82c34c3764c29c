#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>
#include <meniscus/mesh/mesh.h>

#include <cmath>
#include <cstdio>
#include <functional>

namespace {

/// The sum of 0 .. n-1, in parallel: needs the library's scheduler, hence its private libraries.
double sum_below(std::size_t n) {
  const auto map = [](std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t i = begin; i < end; ++i) sum += static_cast<double>(i);
    return sum;
  };
  return meniscus::parallel_reduce(n, 64, meniscus::RunControl(), 0.0, map, std::plus<>());
}

/// An exception must arrive as the type that was thrown.
bool refuses_zero_threads() {
  try {
    meniscus::RunControl({.threads = 0});
  } catch (const meniscus::InvalidInput&) {
    return true;
  }
  return false;
}

}  // namespace

int main() {
  meniscus::mesh::Mesh tetrahedron;
  tetrahedron.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  tetrahedron.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  const double volume = meniscus::mesh::volume(tetrahedron);

  std::printf("volume of a corner of the unit cube: %.6f\n", volume);
  return std::abs(volume - 1.0 / 6) < 1e-12 && sum_below(1000) == 499500 && refuses_zero_threads() ? 0 : 1;
}
