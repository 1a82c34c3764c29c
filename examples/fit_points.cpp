// Fits blobs to points of a surface: example_fit_points MESH-OR-POINTS [OUT.ply [POINTS [BLOBS [CHOSEN.ply]]]]
// A mesh's vertices are points with normals; CHOSEN.ply gets the POINTS of them that were fitted.
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

/// The median distance of a point to the one nearest to it.
double nearest(const std::vector<Vec3>& points) {
  std::vector<double> d;
  for (std::size_t i = 0; i < points.size(); ++i) {
    double near = HUGE_VAL;
    for (std::size_t k = 0; k < points.size(); ++k)
      if (k != i) near = std::min(near, (points[k] - points[i]).norm());
    d.push_back(near);
  }
  std::nth_element(d.begin(), d.begin() + static_cast<std::ptrdiff_t>(d.size() / 2), d.end());
  return d[d.size() / 2];
}

/// Points with normals: a cloud's own, or a mesh's vertices.
points::Cloud read_points(const char* path) {
  const io::Geometry g = io::read_geometry(path);
  if (g.mesh.triangles.empty()) return g.cloud;
  points::Cloud cloud;
  cloud.positions = g.mesh.positions;
  std::vector<double> n;
  for (const Vec3& v : mesh::vertex_normals(g.mesh)) n.insert(n.end(), {v.x(), v.y(), v.z()});
  cloud.attributes.set(attribute::kNormal, 3, std::move(n));
  return cloud;
}

double rms(const std::vector<double>& v) {
  double sum = 0;
  for (const double x : v) sum += x * x;
  return std::sqrt(sum / static_cast<double>(v.size()));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return std::printf("usage: %s MESH-OR-POINTS [OUT.ply [POINTS [BLOBS [CHOSEN.ply]]]]\n", argv[0]), 2;
  const std::size_t count = argc > 3 ? std::strtoul(argv[3], nullptr, 10) : 200;
  const std::size_t blobs = argc > 4 ? std::strtoul(argv[4], nullptr, 10) : 60;
  io::WriteOptions write;
  write.overwrite = true;
  const points::Cloud all = read_points(argv[1]);
  const points::Cloud chosen = points::gathered(all, spread(all.positions, count));
  if (argc > 5) io::write_cloud(argv[5], chosen, write);
  const Box box = points::bounds(chosen);

  // A rough start: a ball of blob under every few points, as wide as these are apart.
  const points::Cloud seeds = points::gathered(chosen, spread(chosen.positions, blobs));
  const double radius = 1.1 * nearest(seeds.positions);
  const auto normals = seeds.attributes.values(attribute::kNormal, 3);
  std::vector<field::Blob> items;
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    const Vec3 c = seeds.positions[i] - 0.6 * radius * Vec3(normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]);
    items.push_back({{c.x(), c.y(), c.z()}, radius, 0.6});
  }
  const auto surface = field::blobs(field::BlobKernel::Gaussian, field::Number::frozen(0.5), items);

  const auto begin = std::chrono::steady_clock::now();
  control::FitOptions options;
  options.tolerance = 1e-4;
  const control::FitReport fit = control::fit(*surface, chosen.positions, options);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const auto everywhere = control::surface_rows(*surface, all.positions, box.diameter());
  std::printf(
      "%zu points, %zu blobs: RMS distance %.4f %% of the diagonal (before %.2f %%), largest %.4f %%, %d steps, %.2f s\n",
      chosen.size(), items.size(), 100 * fit.rms / box.diameter(), 100 * fit.rms_before / box.diameter(),
      100 * fit.largest / box.diameter(), fit.steps, seconds);
  std::printf("all %zu points: RMS %.3f %%\n", all.size(), 100 * rms(everywhere.distance) / box.diameter());
  polygonize::PolygonizeOptions how;
  how.voxel = box.diameter() / 150;
  if (argc > 2) io::write_mesh(argv[2], polygonize::polygonize(*surface, how).mesh, write);
  return 0;
}
