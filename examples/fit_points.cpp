// Fits blobs to points of a mesh's surface: example_fit_points MESH [OUT.ply [POINTS [BLOBS]]]
#include <meniscus/control/fit.h>
#include <meniscus/field/blobs.h>
#include <meniscus/io/geometry.h>
#include <meniscus/polygonize/polygonize.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace {

using namespace meniscus;

/// Vertices far from each other: each next one is the farthest from those before.
std::vector<std::size_t> spread(const std::vector<Vec3>& points, std::size_t count) {
  std::vector<double> near(points.size(), HUGE_VAL);
  std::vector<std::size_t> chosen;
  for (std::size_t next = 0; chosen.size() < std::min(count, points.size());) {
    chosen.push_back(next);
    std::size_t far = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      near[i] = std::min(near[i], (points[i] - points[next]).norm());
      if (near[i] > near[far]) far = i;
    }
    next = far;
  }
  return chosen;
}

double rms(const std::vector<double>& v) {
  double sum = 0;
  for (const double x : v) sum += x * x;
  return std::sqrt(sum / static_cast<double>(v.size()));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return std::printf("usage: %s MESH [OUT.ply [POINTS [BLOBS]]]\n", argv[0]), 2;
  const std::size_t count = argc > 3 ? std::strtoul(argv[3], nullptr, 10) : 200;
  const std::size_t blobs = argc > 4 ? std::strtoul(argv[4], nullptr, 10) : 60;
  const mesh::Mesh wanted = io::read_mesh(argv[1]);
  const std::vector<Vec3> normals = mesh::vertex_normals(wanted);
  const Box box = mesh::bounds(wanted);
  std::vector<Vec3> points;
  for (const std::size_t i : spread(wanted.positions, count)) points.push_back(wanted.positions[i]);

  // A rough start: a ball of blob under every few points.
  const double radius = 0.9 * std::sqrt(mesh::area(wanted) / static_cast<double>(blobs));
  std::vector<field::Blob> items;
  for (const std::size_t i : spread(wanted.positions, blobs)) {
    const Vec3 c = wanted.positions[i] - 0.6 * radius * normals[i];
    items.push_back({{c.x(), c.y(), c.z()}, radius, 0.6});
  }
  const auto surface = field::blobs(field::BlobKernel::Gaussian, field::Number::frozen(0.5), items);

  const auto begin = std::chrono::steady_clock::now();
  control::FitOptions options;
  options.tolerance = 1e-4;
  const control::FitReport fit = control::fit(*surface, points, options);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const auto everywhere = control::surface_rows(*surface, wanted.positions, box.diameter());
  std::printf(
      "%zu points, %zu blobs: RMS distance %.4f %% of the diagonal (before %.2f %%), largest %.4f %%, %d steps, %.2f s\n",
      points.size(), blobs, 100 * fit.rms / box.diameter(), 100 * fit.rms_before / box.diameter(),
      100 * fit.largest / box.diameter(), fit.steps, seconds);
  std::printf("all %zu vertices: RMS %.3f %%\n", wanted.positions.size(), 100 * rms(everywhere.distance) / box.diameter());
  polygonize::PolygonizeOptions how;
  how.voxel = box.diameter() / 150;
  io::WriteOptions write;
  write.overwrite = true;
  if (argc > 2) io::write_mesh(argv[2], polygonize::polygonize(*surface, how).mesh, write);
  return 0;
}
