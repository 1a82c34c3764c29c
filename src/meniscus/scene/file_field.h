#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/field/field.h>
#include <meniscus/io/geometry.h>

#include <memory>
#include <optional>
#include <string>

namespace meniscus::scene {

/// Signed distance to the closed mesh in a file (see band::mesh_to_grid). `voxel` in world units; not given: a 200th of the
/// mesh's diameter.
std::unique_ptr<field::Field> field_from_mesh(const std::string& path, std::optional<double> voxel, const RunControl& run);
std::unique_ptr<field::Field> field_from_mesh(const mesh::Mesh& mesh, const std::string& path, std::optional<double> voxel,
                                              const RunControl& run);

/// The level set in a .vdb file.
std::unique_ptr<field::Field> field_from_grid(const std::string& path, const RunControl& run);

struct ParticleFieldOptions {
  /// Of every particle, world units: a lone one becomes a sphere of this size. Not given: the attribute pscale, and without
  /// that 0.75 of points::bulk_spacing.
  std::optional<double> radius;
  std::size_t frame = 0;  ///< time step of a file that holds several
};

/// Blobs about the particles in a file; their velocities make it move. Throws InvalidInput when no radius can be told.
std::unique_ptr<field::Field> field_from_particles(const std::string& path, const ParticleFieldOptions& options,
                                                   const RunControl& run);
std::unique_ptr<field::Field> field_from_particles(const points::Cloud& cloud, std::optional<double> radius);

/// The radius that field_from_particles takes when it is given none; nothing when it cannot be told.
std::optional<double> default_radius(const points::Cloud& cloud);

}  // namespace meniscus::scene
