#include <meniscus/band/mesh_to_grid.h>
#include <meniscus/base/error.h>
#include <meniscus/field/blobs.h>
#include <meniscus/field/grid_field.h>
#include <meniscus/io/vdb.h>
#include <meniscus/points/spacing.h>
#include <meniscus/scene/file_field.h>

namespace meniscus::scene {
namespace {

constexpr double kVoxelsPerDiameter = 200;
constexpr double kRadiusPerSpacing = 0.75;

std::vector<Vec3> as_vectors(std::span<const double> xyz) {
  std::vector<Vec3> v(xyz.size() / 3);
  for (std::size_t i = 0; i < v.size(); ++i) v[i] = Vec3(xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]);
  return v;
}

}  // namespace

std::unique_ptr<field::Field> field_from_mesh(const mesh::Mesh& mesh, const std::string& path, std::optional<double> voxel,
                                              const RunControl& run) {
  band::MeshToGridOptions options;
  options.voxel = voxel.value_or(mesh::bounds(mesh).diameter() / kVoxelsPerDiameter);
  try {
    const auto grid = std::make_shared<const field::Grid>(band::mesh_to_grid(mesh, options, run));
    return std::make_unique<field::GridField>(grid, field::Interpolation::Cubic, run);
  } catch (const InvalidInput& e) {
    throw IoError(path, e.what());
  }
}

std::unique_ptr<field::Field> field_from_mesh(const std::string& path, std::optional<double> voxel, const RunControl& run) {
  return field_from_mesh(io::read_mesh(path), path, voxel, run);
}

std::unique_ptr<field::Field> field_from_grid(const std::string& path, const RunControl& run) {
  const auto grid = std::make_shared<const field::Grid>(io::read_vdb(path));
  return std::make_unique<field::GridField>(grid, field::Interpolation::Cubic, run);
}

std::optional<double> default_radius(const points::Cloud& cloud) {
  const double spacing = points::bulk_spacing(cloud);
  if (!(spacing > 0)) return std::nullopt;
  return kRadiusPerSpacing * spacing;
}

std::unique_ptr<field::Field> field_from_particles(const points::Cloud& cloud, std::optional<double> radius) {
  const auto own = cloud.attributes.values(attribute::kRadius, 1);
  std::vector<double> radii;
  if (radius) {
    radii = {*radius};
  } else if (!own.empty()) {
    radii.assign(own.begin(), own.end());
  } else if (const auto r = default_radius(cloud)) {
    radii = {*r};
  } else if (cloud.empty()) {
    radii = {1};
  } else {
    throw InvalidInput("the particles have no radius and no spacing to tell it from: give a radius");
  }
  return field::particles(cloud.positions, radii, as_vectors(cloud.attributes.values(attribute::kVelocity, 3)));
}

std::unique_ptr<field::Field> field_from_particles(const std::string& path, const ParticleFieldOptions& options,
                                                   const RunControl& run) {
  run.check();
  io::ReadOptions read;
  read.frame = options.frame;
  const points::Cloud cloud = io::read_cloud(path, read);
  try {
    return field_from_particles(cloud, options.radius);
  } catch (const InvalidInput& e) {
    throw IoError(path, e.what());
  }
}

}  // namespace meniscus::scene
