#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>
#include <meniscus/polygonize/brick_cells.h>
#include <meniscus/polygonize/shell.h>

#include <algorithm>
#include <iterator>

namespace meniscus::polygonize {
namespace {

constexpr std::size_t kBricksPerBlock = 32;

/// What one block of bricks yields.
struct BlockResult {
  std::vector<SurfaceBrick> bricks;  // first_cell and first_vertex counted within the block
  BrickCells cells;
  std::vector<Coord> reached;  // neighbours into which the surface continues
  std::size_t evaluations = 0;
  std::size_t nan_samples = 0;
};

/// Forces the samples on the lattice's rim and beyond outside.
void close_at_rim(const Lattice& lattice, const Coord& brick, double* values) {
  std::array<int, 3> first{};
  std::array<int, 3> last{};
  bool touched = false;
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int64_t base = std::int64_t{brick[a]} * kBrickCells;
    first[a] = static_cast<int>(std::clamp<std::int64_t>(lattice.low[a] + 1 - base, 0, kBrickPoints));
    last[a] = static_cast<int>(std::clamp<std::int64_t>(lattice.high[a] - 1 - base, -1, kBrickPoints - 1));
    touched = touched || first[a] > 0 || last[a] < kBrickPoints - 1;
  }
  if (!touched) return;
  const auto within = [&](std::size_t a, int i) { return first[a] <= i && i <= last[a]; };
  for (int i = 0; i < kBrickPoints; ++i)
    for (int j = 0; j < kBrickPoints; ++j)
      for (int k = 0; k < kBrickPoints; ++k) {
        double* v = values + (i * kBrickPoints + j) * kBrickPoints + k;
        if (*v < 0 && !(within(0, i) && within(1, j) && within(2, k))) *v = 0;
      }
}

void process_block(const Sampler& sampler, const Lattice& lattice, std::span<const Coord> bricks,
                   const ShellOptions& options, BlockResult& result) {
  std::vector<double> samples(bricks.size() * kBrickSamples);
  result.evaluations = sampler.sample(bricks, samples.data());
  for (const double v : samples) result.nan_samples += v != v ? 1 : 0;
  for (std::size_t n = 0; n < bricks.size(); ++n) {
    const Coord& index = bricks[n];
    double* values = samples.data() + n * kBrickSamples;
    close_at_rim(lattice, index, values);
    SignRows rows;
    if (!rows.read(values)) continue;
    SurfaceBrick brick;
    brick.index = index;
    append_cells(lattice, rows, values, options.trilinear, brick, result.cells);
    result.bricks.push_back(brick);
    append_reached(rows, index, result.reached);
  }
}

std::vector<BlockResult> process(const Sampler& sampler, const Lattice& lattice, const std::vector<Coord>& bricks,
                                 const ShellOptions& options, const RunControl& run) {
  std::vector<BlockResult> results((bricks.size() + kBricksPerBlock - 1) / kBricksPerBlock);
  parallel_blocks(bricks.size(), kBricksPerBlock, run, [&](std::size_t begin, std::size_t end) {
    process_block(sampler, lattice, {bricks.data() + begin, end - begin}, options, results[begin / kBricksPerBlock]);
  });
  return results;
}

void sort_unique(std::vector<Coord>& list) {
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

/// Bricks that the surface reaches and that are not in the sorted list `known`.
std::vector<Coord> unknown_bricks(std::vector<BlockResult>& results, const std::vector<Coord>& known,
                                  const Lattice& lattice) {
  std::vector<Coord> reached;
  for (BlockResult& r : results) {
    for (const Coord& c : r.reached)
      if (lattice.reaches(c) && !std::binary_search(known.begin(), known.end(), c)) reached.push_back(c);
    r.reached = {};
  }
  sort_unique(reached);
  return reached;
}

/// A brick's place in the results and, later, in the shell.
struct Placed {
  BlockResult* block;
  SurfaceBrick* brick;
};

/// Puts the blocks' results together in the order of brick indices.
void assemble(std::vector<BlockResult>& results, Shell& shell, bool with_normals, const RunControl& run) {
  std::vector<Placed> order;
  for (BlockResult& r : results)
    for (SurfaceBrick& b : r.bricks) order.push_back({&r, &b});
  std::sort(order.begin(), order.end(), [](const Placed& a, const Placed& b) { return a.brick->index < b.brick->index; });

  shell.bricks.resize(order.size());
  std::size_t cells = 0;
  std::size_t vertices = 0;
  for (std::size_t n = 0; n < order.size(); ++n) {
    shell.bricks[n] = *order[n].brick;
    shell.bricks[n].first_cell = static_cast<std::uint32_t>(cells);
    shell.bricks[n].first_vertex = static_cast<std::uint32_t>(vertices);
    cells += order[n].brick->cell_count;
    vertices += order[n].brick->vertex_count;
    if (vertices >= std::size_t{1} << 31)
      throw ResourceLimit("polygonize: the mesh would have more than 2147483647 vertices; use a larger voxel");
  }
  shell.cells.resize(cells);
  shell.positions.resize(vertices);
  if (with_normals) shell.normals.resize(vertices);
  parallel_for(order.size(), 64, run, [&](std::size_t n) {
    const SurfaceBrick& from = *order[n].brick;
    const SurfaceBrick& to = shell.bricks[n];
    const BrickCells& source = order[n].block->cells;
    const auto copy = [](const auto& list, std::size_t first, std::size_t count, auto& out, std::size_t at) {
      std::copy_n(list.begin() + static_cast<std::ptrdiff_t>(first), count, out.begin() + static_cast<std::ptrdiff_t>(at));
    };
    copy(source.cells, from.first_cell, from.cell_count, shell.cells, to.first_cell);
    copy(source.positions, from.first_vertex, from.vertex_count, shell.positions, to.first_vertex);
    if (with_normals) copy(source.normals, from.first_vertex, from.vertex_count, shell.normals, to.first_vertex);
  });
}

/// The brick whose vertices include this one.
std::vector<SurfaceBrick>::const_iterator brick_of(const Shell& shell, std::size_t vertex) {
  return std::upper_bound(shell.bricks.begin(), shell.bricks.end(), vertex,
                          [](std::size_t v, const SurfaceBrick& b) { return v < b.first_vertex; }) -
         1;
}

/// Bit number `bit` of word `slab` of a brick's mask, as a cell of the lattice.
Coord cell_at(const SurfaceBrick& brick, int slab, int bit) {
  return {brick.index[0] * kBrickCells + slab, brick.index[1] * kBrickCells + bit / 8,
          brick.index[2] * kBrickCells + bit % 8};
}

void check_cells(std::size_t bricks, std::size_t max_cells) {
  const std::size_t cells = bricks * kBrickCells * kBrickCells * kBrickCells;
  if (cells > max_cells)
    throw ResourceLimit("polygonize: " + std::to_string(cells) + " cells would be sampled, more than the allowed " +
                        std::to_string(max_cells) + "; use a larger voxel or a smaller box");
}

}  // namespace

bool Lattice::reaches(const Coord& brick) const {
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int64_t base = std::int64_t{brick[a]} * kBrickCells;
    if (base >= high[a] || base + kBrickCells <= low[a]) return false;
  }
  return true;
}

const SurfaceBrick* Shell::find(const Coord& brick) const {
  const auto at = std::lower_bound(bricks.begin(), bricks.end(), brick,
                                   [](const SurfaceBrick& b, const Coord& c) { return b.index < c; });
  return at != bricks.end() && at->index == brick ? &*at : nullptr;
}

Shell build_shell(const Sampler& sampler, const Lattice& lattice, std::vector<Coord> candidates, const ShellOptions& options,
                  const RunControl& run) {
  Shell shell;
  shell.lattice = lattice;
  std::vector<Coord> known;
  std::vector<BlockResult> results;
  while (!candidates.empty()) {
    check_cells(known.size() + candidates.size(), options.max_cells);
    std::vector<BlockResult> fresh = process(sampler, lattice, candidates, options, run);
    std::sort(candidates.begin(), candidates.end());
    const auto middle = known.insert(known.end(), candidates.begin(), candidates.end());
    std::inplace_merge(known.begin(), middle, known.end());
    candidates = unknown_bricks(fresh, known, lattice);
    std::move(fresh.begin(), fresh.end(), std::back_inserter(results));
  }
  shell.sampled_bricks = known.size();
  for (const BlockResult& r : results) {
    shell.evaluations += r.evaluations;
    shell.nan_samples += r.nan_samples;
  }
  assemble(results, shell, options.trilinear, run);
  return shell;
}

std::vector<Coord> cells_of(const Shell& shell, std::size_t begin, std::size_t end) {
  std::vector<Coord> cells;
  if (begin == end) return cells;
  cells.reserve(end - begin);
  auto brick = brick_of(shell, begin);
  for (std::size_t vertex = brick->first_vertex; vertex < end; ++brick) {
    const SurfaceCell* cell = shell.cells.data() + brick->first_cell;
    for (int i = 0; i < kBrickCells; ++i)
      for (std::uint64_t word = brick->mask[static_cast<std::size_t>(i)]; word != 0; word &= word - 1, ++cell) {
        const Coord c = cell_at(*brick, i, __builtin_ctzll(word));
        for (int n = CellCases::get()[cell->kind].vertices(); n > 0; --n, ++vertex)
          if (begin <= vertex && vertex < end) cells.push_back(c);
      }
  }
  return cells;
}

VertexPlace place_of(const Shell& shell, std::size_t vertex) {
  const SurfaceBrick& brick = *brick_of(shell, vertex);
  const auto in_brick = static_cast<std::uint16_t>(vertex - brick.first_vertex);
  const auto first = shell.cells.begin() + brick.first_cell;
  const auto after = std::upper_bound(first, first + brick.cell_count, in_brick,
                                      [](std::uint16_t v, const SurfaceCell& c) { return v < c.first_vertex; });
  const SurfaceCell& cell = *(after - 1);
  const CellCase& kind = CellCases::get()[cell.kind];
  const CellVertex own = cell_vertex(kind, in_brick - cell.first_vertex);

  VertexPlace place;
  place.cell = cells_of(shell, vertex, vertex + 1).front();
  Vec3 middle(0.5, 0.5, 0.5);
  if (own.split_axis >= 0) middle[own.split_axis] = 1;
  place.center = shell.lattice.point(place.cell) + shell.lattice.voxel * middle;
  for (int e = 0; e < 12; ++e) {
    if (((own.edges >> e) & 1) == 0) continue;
    for (const int corner : {edge_corner(e), edge_end(e)}) {
      place.corners.push_back(
          {place.cell[0] + (corner >> 2), place.cell[1] + ((corner >> 1) & 1), place.cell[2] + (corner & 1)});
      place.inside.push_back(((kind.inside >> corner) & 1) != 0);
    }
  }
  return place;
}

}  // namespace meniscus::polygonize
