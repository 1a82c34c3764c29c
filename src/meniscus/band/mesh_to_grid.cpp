#include <meniscus/band/mesh_to_grid.h>

#include <meniscus/band/vdb_grid.h>
#include <meniscus/base/error.h>
#include <meniscus/mesh/validate.h>

#include <openvdb/tools/MeshToVolume.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace meniscus::band {

namespace {

constexpr double kMostVoxelsAcross = 1e6;  // vertices in voxel units are floats in OpenVDB

/// Lets OpenVDB see that the job was cancelled.
struct Interrupter : openvdb::util::NullInterrupter {
  explicit Interrupter(const RunControl& r) : run(r) {}
  bool wasInterrupted(int) override { return run.cancelled(); }
  const RunControl& run;
};

std::string count(std::size_t n, const std::string& noun) { return std::to_string(n) + " " + noun + (n == 1 ? "" : "s"); }

void check(const mesh::Mesh& mesh, const MeshToGridOptions& options) {
  if (!(options.voxel > 0) || !std::isfinite(options.voxel))
    throw InvalidInput("mesh to grid: the voxel size must be positive");
  if (!(options.half_width >= 2 && options.half_width <= 100))
    throw InvalidInput("mesh to grid: the half width must be 2 to 100 voxels");
  if (mesh.triangles.empty()) throw InvalidInput("mesh to grid: the mesh has no triangles");
  const mesh::Audit audit = mesh::validate(mesh);
  if (audit.out_of_range_triangles > 0)
    throw InvalidInput("mesh to grid: " + count(audit.out_of_range_triangles, "triangle") +
                       " refer to vertices that do not exist");
  if (audit.nonfinite_vertices > 0)
    throw InvalidInput("mesh to grid: " + count(audit.nonfinite_vertices, "vertex coordinate") + " not finite");
  if (!audit.closed())
    throw InvalidInput("mesh to grid: the mesh is open: " + count(audit.boundary_edges, "edge") +
                       " with only one triangle; close its holes or weld equal vertices first");
}

void check_size(const mesh::Mesh& mesh, const MeshToGridOptions& options) {
  const double across = mesh::bounds(mesh).size().maxCoeff() / options.voxel;
  const double bytes = estimated_bytes(mesh, options);
  if (bytes <= static_cast<double>(options.max_bytes) && across <= kMostVoxelsAcross) return;
  const auto megabytes = static_cast<std::uint64_t>(std::min(bytes / 1e6, 1e18));
  throw ResourceLimit("mesh to grid: voxel " + std::to_string(options.voxel) + " is too small for this mesh: about " +
                      std::to_string(megabytes) + " MB and " + std::to_string(across) +
                      " voxels across; take a larger voxel");
}

}  // namespace

double estimated_bytes(const mesh::Mesh& mesh, const MeshToGridOptions& options) {
  // A band of 2w voxels about the surface touches bricks up to one brick further out.
  constexpr double kBytesPerBrick = 12'000;  // distances and triangle numbers in OpenVDB, then our samples
  const double across = 2 * options.half_width + field::Grid::kBrick;
  double longest = 0;
  for (const Triangle& t : mesh.triangles)
    for (const std::size_t i : {0u, 1u, 2u})
      longest = std::max(longest, (mesh.positions[static_cast<std::size_t>(t[i])] -
                                   mesh.positions[static_cast<std::size_t>(t[(i + 1) % 3])])
                                      .norm());
  const double on_area = mesh::area(mesh) / (options.voxel * options.voxel) * across;
  const double on_edge = longest / options.voxel * across * across;
  return kBytesPerBrick * (8 + (on_area + on_edge) / static_cast<double>(field::Grid::kBrickVoxels));
}

field::Grid mesh_to_grid(const mesh::Mesh& mesh, const MeshToGridOptions& options, const RunControl& run) {
  check(mesh, options);
  check_size(mesh, options);

  // OpenVDB takes vertices as floats: measure them from a voxel near the middle.
  const Vec3 middle = mesh::bounds(mesh).center() / options.voxel;
  const Vec3 origin = options.voxel * middle.array().round().matrix();
  std::vector<openvdb::Vec3s> points;
  points.reserve(mesh.positions.size());
  for (const Vec3& p : mesh.positions) {
    const Vec3 local = (p - origin) / options.voxel;
    points.emplace_back(static_cast<float>(local.x()), static_cast<float>(local.y()), static_cast<float>(local.z()));
  }
  std::vector<openvdb::Vec3I> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles)
    triangles.emplace_back(static_cast<openvdb::Index32>(t[0]), static_cast<openvdb::Index32>(t[1]),
                           static_cast<openvdb::Index32>(t[2]));

  const auto transform = openvdb::math::Transform::createLinearTransform(options.voxel);
  transform->postTranslate(openvdb::Vec3d(origin.data()));
  const auto width = static_cast<float>(options.half_width);
  const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> adapter(points, triangles);
  Interrupter interrupter(run);
  openvdb::util::NullInterrupter& base = interrupter;  // the library holds code for this type
  openvdb::FloatGrid::Ptr grid;
  run.execute([&] {
    grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(base, adapter, *transform, width, width,
                                                            openvdb::tools::DISABLE_RENORMALIZATION);
  });
  run.check();

  field::Grid result = from_vdb(*grid);
  for (std::size_t b = 0; b < result.bricks().size(); ++b)
    if (std::any_of(result.brick(b).begin(), result.brick(b).end(), [](float v) { return v < 0; })) return result;
  throw InvalidInput("mesh to grid: nothing of the inside is left at voxel " + std::to_string(options.voxel) +
                     "; take a smaller voxel");
}

}  // namespace meniscus::band
