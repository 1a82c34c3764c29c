#pragma once

#include <meniscus/band/outline.h>

#include <cstdint>
#include <vector>

namespace meniscus::band {

/// The points where the surface crosses the edges of the grid: where speeds are evaluated, once each (THEORY, Trap 5).
/// Ordered by brick and, within it, by eighths of the brick, so that runs of crossings are compact in space.
struct Crossings {
  field::PositionBatch x;                  ///< linear interpolation along the edge
  std::vector<Vec3> normal;                ///< outward, unit length (zero where ∇φ vanishes); empty when not asked for
  std::vector<std::uint32_t> inside;       ///< the edge's node inside the surface: brick * 512 + number
  std::vector<std::uint32_t> outside;      ///< the node outside
  std::vector<std::size_t> brick_begin;    ///< crossings of brick b: [brick_begin[b], brick_begin[b + 1])
  std::vector<std::uint32_t> leaves;       ///< numbers of those whose edges lead into the next brick, by brick and axis
  std::vector<std::size_t> leaving_begin;  ///< begin of those of brick b along axis a: number 3 b + a

  std::size_t size() const { return inside.size(); }
  std::span<const std::uint32_t> leaving(std::size_t brick, std::size_t axis) const {
    const std::size_t* begin = leaving_begin.data() + 3 * brick + axis;
    return {leaves.data() + begin[0], leaves.data() + begin[1]};
  }
};

Crossings find_crossings(const Band& band, const RunControl& run = {});
/// The same into arrays that are there already, with or without normals.
void find_crossings(const Band& band, bool normals, Crossings& out, const RunControl& run);
void find_crossings(const Band& band, const Outlines& outlines, bool normals, Crossings& out, const RunControl& run);

/// Speeds at the nodes next to the surface.
struct NodeSpeeds : Spare {  // values, 512 per brick: the mean over the node's crossings, NaN where it has none
  std::vector<char> any;     ///< per brick; where there is none its values are not to be read
};
void near_speeds(const Band& band, const Crossings& crossings, std::span<const double> speed, NodeSpeeds& out,
                 const RunControl& run = {});

/// Speeds in and around some rows of a brick (`phi`: its samples), those of nodes away from the surface carried outwards
/// along ∇φ, so that level sets move together. NaN where nothing has arrived: once over all bricks serves the nodes within
/// 1.5 voxels but one in a thousand, twice every node within two and nearly all within 2.5.
void extend_speeds(const Band& band, const NodeSpeeds& speeds, std::size_t brick, const Halo& phi, const RowLayers& rows,
                   Halo& out);

}  // namespace meniscus::band
