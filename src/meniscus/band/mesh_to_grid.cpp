#include <meniscus/band/mesh_to_grid.h>

#include <meniscus/band/triangle_tree.h>
#include <meniscus/band/vdb_grid.h>
#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>
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

constexpr float kSidesWidth = 2;  // voxels

/// OpenVDB's level set in a narrow band: each sample's side. Its distances are not used.
field::Grid sides(const mesh::Mesh& mesh, const MeshToGridOptions& options, const RunControl& run) {
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
  const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> adapter(points, triangles);
  Interrupter interrupter(run);
  openvdb::util::NullInterrupter& base = interrupter;  // the library holds code for this type
  openvdb::FloatGrid::Ptr grid;
  run.execute([&] {
    grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(base, adapter, *transform, kSidesWidth, kSidesWidth,
                                                            openvdb::tools::DISABLE_RENORMALIZATION);
  });
  run.check();
  return from_vdb(*grid);
}

constexpr double kNear = 0.2;  // voxels: nearer samples have their side looked at twice

field::Coord coord(const field::Coord& brick, int n) {
  return {8 * brick[0] + n / 64, 8 * brick[1] + n / 8 % 8, 8 * brick[2] + n % 8};
}

/// Which side a sample next to the surface is on: OpenVDB errs within a few hundredths of a voxel. The samples before and
/// behind along the axis nearest to the normal are well off the surface, so their sides are right; where they do not lie on
/// either side of it (a thin sheet, a sharp edge) OpenVDB's answer stays.
double side_near(const TriangleTree& tree, const field::Grid& sides, const field::Coord& ijk, const Vec3& x) {
  const double given = sides.value(ijk);
  const Vec3 towards = tree.normal_towards(x, sides.voxel());
  Eigen::Index axis = 0;
  if (!(towards.cwiseAbs().maxCoeff(&axis) > 0.5)) return given;
  field::Coord ahead = ijk, behind = ijk;
  const std::int32_t step = towards[axis] > 0 ? 1 : -1;  // further away on the sample's own side
  ahead[static_cast<std::size_t>(axis)] += step;
  behind[static_cast<std::size_t>(axis)] -= step;
  const bool through = (sides.value(ahead) < 0) != (sides.value(behind) < 0);
  return through ? sides.value(ahead) : given;
}

/// Distances of a brick's samples, by blocks of 4³: what is near a block serves all its samples.
void brick_distances(const TriangleTree& tree, const field::Grid& grid, const field::Coord& brick, double background,
                     double* distances) {
  constexpr std::int32_t kBlock = 4;
  const double voxel = grid.voxel(), radius = 0.5 * (kBlock - 1) * std::sqrt(3.0) * voxel;
  const auto position = [&](double i, double j, double k) {
    return Vec3(grid.origin() + voxel * Vec3(8.0 * brick[0] + i, 8.0 * brick[1] + j, 8.0 * brick[2] + k));
  };
  for (std::int32_t block = 0; block < 8; ++block) {
    const std::int32_t i0 = block / 4 * kBlock, j0 = block / 2 % 2 * kBlock, k0 = block % 2 * kBlock;
    constexpr double kMiddle = 0.5 * (kBlock - 1);
    TriangleTree::Nearby nearby(tree, position(i0 + kMiddle, j0 + kMiddle, k0 + kMiddle), radius * (1 + 1e-9), background);
    for (std::int32_t i = i0; i < i0 + kBlock; ++i)
      for (std::int32_t j = j0; j < j0 + kBlock; ++j)
        for (std::int32_t k = k0; k < k0 + kBlock; ++k)
          distances[field::Grid::number(i, j, k)] = nearby.empty() ? background : nearby.distance(position(i, j, k));
  }
}

/// Bricks that may come within `reach` of the surface, in order.
std::vector<field::Coord> bricks_within(const TriangleTree& tree, const field::Grid& sides, double reach,
                                        const RunControl& run) {
  const double brick = field::Grid::kBrick * sides.voxel();
  const auto around = static_cast<std::int32_t>(std::ceil(reach / brick));
  std::vector<field::Coord> all;
  for (const field::Coord& c : sides.bricks())
    for (std::int32_t i = -around; i <= around; ++i)
      for (std::int32_t j = -around; j <= around; ++j)
        for (std::int32_t k = -around; k <= around; ++k) all.push_back({c[0] + i, c[1] + j, c[2] + k});
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  const double bound = reach + 0.5 * std::sqrt(3.0) * brick;
  std::vector<char> near(all.size());
  parallel_for(all.size(), 64, run, [&](std::size_t b) {
    const Vec3 middle = Vec3(all[b][0], all[b][1], all[b][2]).array() + 0.5;
    near[b] = tree.distance(sides.origin() + brick * middle, bound) < bound;
  });
  std::vector<field::Coord> out;
  for (std::size_t b = 0; b < all.size(); ++b)
    if (near[b] != 0) out.push_back(all[b]);
  return out;
}

/// The sides of a brick's samples. A brick that is not there lies on one side: that of most of its columns, as a sample next
/// to the surface may err.
class BrickSides {
 public:
  BrickSides(const field::Grid& sides, const field::Coord& brick) : view_(sides.view(brick)) {
    int inside = 0;
    if (view_.samples == nullptr)
      for (std::int32_t n = 0; n < 64; ++n) inside += view_.value(n / 8, n % 8, 0) < 0;
    far_ = inside > 32 ? -1 : 1;
  }
  double operator()(std::int32_t n) const { return view_.samples != nullptr ? static_cast<double>(view_.samples[n]) : far_; }

 private:
  field::Grid::View view_;
  double far_;
};

/// Distances with the signs of `sides`.
std::vector<float> signed_distances(const TriangleTree& tree, const field::Grid& sides,
                                    const std::vector<field::Coord>& bricks, double background, const RunControl& run) {
  std::vector<float> values(bricks.size() * field::Grid::kBrickVoxels);
  parallel_for(bricks.size(), 8, run, [&](std::size_t b) {
    double distances[field::Grid::kBrickVoxels];
    brick_distances(tree, sides, bricks[b], background, distances);
    const BrickSides given(sides, bricks[b]);
    for (std::size_t n = 0; n < field::Grid::kBrickVoxels; ++n) {
      const auto v = static_cast<std::int32_t>(n);
      double side = given(v);
      if (distances[n] < kNear * sides.voxel()) {
        const field::Coord ijk = coord(bricks[b], v);
        side = side_near(tree, sides, ijk, sides.origin() + sides.voxel() * Vec3(ijk[0], ijk[1], ijk[2]));
      }
      values[b * field::Grid::kBrickVoxels + n] = static_cast<float>(std::copysign(distances[n], side));
    }
  });
  return values;
}

/// A grid of those bricks that say more than their absence would.
field::Grid trimmed(const field::Grid& sides, const std::vector<field::Coord>& all, double background,
                    const std::vector<float>& values) {
  std::vector<field::Coord> bricks;
  std::vector<float> kept;
  bool inside = false;
  for (std::size_t b = 0; b < all.size(); ++b) {
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(b * field::Grid::kBrickVoxels);
    const auto last = first + field::Grid::kBrickVoxels;
    if (std::all_of(first, last, [&](float v) { return std::abs(v) >= static_cast<float>(background); })) continue;
    inside = inside || std::any_of(first, last, [](float v) { return v < 0; });
    bricks.push_back(all[b]);
    kept.insert(kept.end(), first, last);
  }
  if (!inside)
    throw InvalidInput("mesh to grid: nothing of the inside is left at voxel " + std::to_string(sides.voxel()) +
                       "; take a smaller voxel");
  return {sides.voxel(), sides.origin(), background, std::move(bricks), std::move(kept)};
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
  const field::Grid side = sides(mesh, options, run);
  const TriangleTree tree(mesh);
  const double background = options.half_width * options.voxel;
  const std::vector<field::Coord> bricks = bricks_within(tree, side, background, run);
  return trimmed(side, bricks, background, signed_distances(tree, side, bricks, background, run));
}

}  // namespace meniscus::band
