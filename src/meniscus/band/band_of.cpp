#include <meniscus/band/band.h>
#include <meniscus/band/redistance.h>
#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace meniscus::band {
namespace {

/// A cube of bricks: `size` bricks wide from `first`.
struct Cube {
  Coord first;
  std::int32_t size;
};

std::int32_t brick_of(double x, double origin, double voxel) {
  const double b = std::floor((x - origin) / (8 * voxel));
  if (!(std::abs(b) < 1e8)) throw InvalidInput("the box is too large for the voxel size");
  return static_cast<std::int32_t>(b);
}

Box world_box(const Cube& c, double voxel) {
  const Vec3 low = 8 * voxel * Vec3(c.first[0], c.first[1], c.first[2]);
  return {low - Vec3::Constant(2 * voxel), low + Vec3::Constant((8.0 * c.size + 1) * voxel)};
}

/// Bricks that may hold the surface: an octree pruned by the field's range, breadth first, in a fixed order.
std::vector<Coord> candidates(const field::Field& field, double voxel, const Box& box, std::size_t max_bricks,
                              const RunControl& run) {
  Coord low{}, high{};
  std::int32_t size = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto e = static_cast<Eigen::Index>(a);
    low[a] = brick_of(box.min[e], 0, voxel);
    high[a] = brick_of(box.max[e], 0, voxel);
    while (size < high[a] - low[a] + 1) size *= 2;
  }
  std::vector<Cube> level = {{low, size}};
  for (; size > 1; size /= 2) {
    std::vector<Cube> next;
    for (const Cube& c : level)
      for (int q = 0; q < 8; ++q) {
        const std::int32_t half = c.size / 2;
        const Cube part{{c.first[0] + (q >> 2) * half, c.first[1] + (q >> 1 & 1) * half, c.first[2] + (q & 1) * half}, half};
        if (part.first[0] > high[0] || part.first[1] > high[1] || part.first[2] > high[2]) continue;
        next.push_back(part);
      }
    std::vector<char> keep(next.size());
    parallel_for(next.size(), 16, run,
                 [&](std::size_t i) { keep[i] = field.range(world_box(next[i], voxel)).contains_zero(); });
    level.clear();
    for (std::size_t i = 0; i < next.size(); ++i)
      if (keep[i] != 0) level.push_back(next[i]);
    if (level.size() > max_bricks)
      throw ResourceLimit("this voxel size needs more than " + std::to_string(max_bricks) +
                          " bricks of 8x8x8 voxels (about " +
                          std::to_string(max_bricks * 512 * 3 * sizeof(float) / 1000000) + " MB): choose a larger one");
  }
  std::vector<Coord> bricks;
  for (const Cube& c : level) bricks.push_back(c.first);
  return bricks;
}

}  // namespace

Band band_of(const field::Field& field, double voxel, const Box& box, std::size_t max_bricks, const RunControl& run) {
  const Band empty(voxel);
  const Box region = (box.empty() ? field.bounds() : box).padded(voxel);
  if (region.empty()) return empty;
  if (!region.finite()) throw InvalidInput("an unbounded surface needs a box");
  const std::vector<Coord> bricks = candidates(field, voxel, region, max_bricks, run);
  std::vector<float> values(bricks.size() * Band::kBrickNodes);
  parallel_for(bricks.size(), 4, run, [&](std::size_t b) {
    field::PositionBatch x(Band::kBrickNodes);
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < 8; ++j)
        for (int k = 0; k < 8; ++k)
          x.set(static_cast<std::size_t>((i * 8 + j) * 8 + k),
                voxel * Vec3(8.0 * bricks[b][0] + i, 8.0 * bricks[b][1] + j, 8.0 * bricks[b][2] + k));
    field::JetBatch jets(Band::kBrickNodes, field::Order::Gradient);
    field.evaluate(x.view(), jets.view());
    for (std::size_t n = 0; n < Band::kBrickNodes; ++n) {
      const double f = jets.value(n), slope = jets.gradient(n).norm(), far = Band::kHalfWidth * voxel;
      values[b * Band::kBrickNodes + n] = static_cast<float>(std::abs(f) < far * slope ? f / slope : std::copysign(far, f));
    }
  });
  Band band(voxel, Vec3::Zero(), bricks, values);
  redistance(band, run);
  band.adapt(run);
  redistance(band, run);
  return band;
}

}  // namespace meniscus::band
