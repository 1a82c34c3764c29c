#pragma once

#include <meniscus/field/grid.h>
#include <meniscus/io/geometry.h>

namespace meniscus::io {

/// Reads a level set (a float grid with uniform voxels, no rotation) from a VDB file: the grid `name`, or the first float
/// grid. Throws IoError for other kinds of grids and for files OpenVDB refuses. OpenVDB itself checks little: a damaged file
/// can make it hang.
field::Grid read_vdb(const std::string& path, const std::optional<std::string>& name = {}, const ReadOptions& options = {});

/// Names of the grids in a VDB file, each with its value type: "surface (float)".
std::vector<std::string> vdb_grids(const std::string& path, const ReadOptions& options = {});

/// Writes a level set named "surface", inside tiles filled, values at and beyond the background inactive. The same grid
/// gives the same bytes.
void write_vdb(const std::string& path, const field::Grid& grid, const WriteOptions& options = {});

/// The same with a second grid "velocity" (vec3s, units per second) of the same active voxels: `velocity` holds one vector
/// per sample, in the order of the grid's bricks. Throws InvalidInput for another number.
void write_vdb(const std::string& path, const field::Grid& grid, std::span<const Vec3> velocity,
               const WriteOptions& options = {});

}  // namespace meniscus::io
