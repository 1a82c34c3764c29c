#pragma once

#include <meniscus/field/grid.h>

#include <openvdb/openvdb.h>

/// Private: for .cpp files of folders that may use OpenVDB; no header may include this one.
namespace meniscus::band {

/// A level set of class GRID_LEVEL_SET: the bricks become leaves bit by bit, voxels nearer than the background are active,
/// and tiles are filled with the background of their side, so that other programs see a signed field everywhere.
openvdb::FloatGrid::Ptr to_vdb(const field::Grid& grid);

/// The leaves of `grid` bit by bit, active tiles as bricks. Samples that are not finite count as outside.
/// Throws InvalidInput when voxels are not cubes along the axes or the background is not positive and finite, ResourceLimit
/// when active tiles hold more than 2^28 voxels.
field::Grid from_vdb(const openvdb::FloatGrid& grid);

}  // namespace meniscus::band
