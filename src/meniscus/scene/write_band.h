#pragma once

#include <meniscus/band/band.h>
#include <meniscus/base/function_ref.h>
#include <meniscus/io/geometry.h>

#include <string>

namespace meniscus::scene {

/// Velocities at places near a surface, world units per second.
using VelocityAt = FunctionRef<std::vector<Vec3>(std::span<const Vec3>)>;

/// Writes a band's level set as a .vdb file, with `velocity` also a grid of the velocities at its active voxels.
void write_band(const std::string& path, const band::Band& band, const VelocityAt* velocity, const io::WriteOptions& write);

}  // namespace meniscus::scene
