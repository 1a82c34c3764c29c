#include <meniscus/polygonize/finish.h>
#include <meniscus/polygonize/polygonize.h>
#include <meniscus/polygonize/shell.h>

#include <algorithm>
#include <limits>

namespace meniscus::polygonize {
namespace {

constexpr std::size_t kNoLimit = std::numeric_limits<std::size_t>::max();
static_assert(field::Grid::kBrick == kBrickCells);

/// A brick's 9³ points: its own 8³ samples and the first ones of its neighbours on the upper sides.
class GridSampler : public Sampler {
 public:
  explicit GridSampler(const field::Grid& grid) : grid_(grid) {}

  std::size_t sample(std::span<const Coord> bricks, double* values) const override {
    for (const Coord& brick : bricks) {
      for (int dx = 0; dx < 2; ++dx)
        for (int dy = 0; dy < 2; ++dy)
          for (int dz = 0; dz < 2; ++dz)
            copy_part(grid_.view({brick[0] + dx, brick[1] + dy, brick[2] + dz}), {dx, dy, dz}, values);
      values += kBrickSamples;
    }
    return 0;
  }

 private:
  /// The points that come from the brick on side `d`: eight an axis where d is 0, the first one where it is 1.
  static void copy_part(const field::Grid::View& view, const std::array<int, 3>& d, double* values) {
    const auto count = [](int side) { return side == 0 ? kBrickCells : 1; };
    for (int i = 0; i < count(d[0]); ++i)
      for (int j = 0; j < count(d[1]); ++j) {
        double* row = values + ((i + d[0] * kBrickCells) * kBrickPoints + j + d[1] * kBrickCells) * kBrickPoints;
        for (int k = 0; k < count(d[2]); ++k) row[k + d[2] * kBrickCells] = static_cast<double>(view.value(i, j, k));
      }
  }

  const field::Grid& grid_;
};

/// The lattice that holds every brick. Past its bricks a grid is outside, as is a lattice's rim.
Lattice lattice_over(const field::Grid& grid) {
  Lattice lattice;
  lattice.origin = grid.origin();
  lattice.voxel = grid.voxel();
  lattice.low.fill(std::numeric_limits<std::int32_t>::max());
  lattice.high.fill(std::numeric_limits<std::int32_t>::min());
  for (const Coord& b : grid.bricks())
    for (std::size_t a = 0; a < 3; ++a) {
      lattice.low[a] = std::min(lattice.low[a], b[a] * kBrickCells - 1);
      lattice.high[a] = std::max(lattice.high[a], (b[a] + 1) * kBrickCells);
    }
  return lattice;
}

/// Whether the surface crosses between the first voxels of a brick along `axis` and the empty place before it.
bool crossed_below(std::span<const float> brick, const field::Grid::View& below, std::size_t axis) {
  for (int p = 0; p < kBrickCells; ++p)
    for (int q = 0; q < kBrickCells; ++q) {
      std::array<int, 3> first = axis == 0 ? std::array{0, p, q} : axis == 1 ? std::array{p, 0, q} : std::array{p, q, 0};
      const float here = brick[field::Grid::number(first[0], first[1], first[2])];
      first[axis] = kBrickCells - 1;
      if ((here < 0) != (below.value(first[0], first[1], first[2]) < 0)) return true;
    }
  return false;
}

/// The grid's bricks, and empty places below them where the surface leaves its bricks.
std::vector<Coord> candidates(const field::Grid& grid) {
  std::vector<Coord> list(grid.bricks().begin(), grid.bricks().end());
  for (std::size_t b = 0; b < grid.bricks().size(); ++b)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Coord below = grid.bricks()[b];
      --below[axis];
      const field::Grid::View view = grid.view(below);
      if (!view.samples && crossed_below(grid.brick(b), view, axis)) list.push_back(below);
    }
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
  return list;
}

}  // namespace

PolygonizeResult polygonize_grid(const field::Grid& grid, const PolygonizeGridOptions& options, RunControl run) {
  PolygonizeResult result;
  if (grid.bricks().empty()) return result;
  const GridSampler sampler(grid);
  Shell shell = build_shell(sampler, lattice_over(grid), candidates(grid), {.trilinear = true, .max_cells = kNoLimit}, run);
  run.progress(0.6, "connecting");
  if (!options.normals) shell.normals.clear();
  result.mesh = finish(
      std::move(shell), {options.max_triangles, options.count_components}, [](Shell&, std::span<const std::size_t>) {},
      result.report, run);
  run.progress(1);
  return result;
}

}  // namespace meniscus::polygonize
