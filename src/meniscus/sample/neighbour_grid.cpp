#include <meniscus/base/parallel.h>
#include <meniscus/sample/neighbour_grid.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

namespace meniscus::sample {
namespace {

constexpr int kAxisBits = 20;  // cells per axis at the finest level; 3·20 bits of Z-order key
constexpr std::size_t kCellBlock = 64;
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// Puts two zero bits between the bits of v.
std::uint64_t spread_bits(std::uint64_t v) {
  v &= 0x1fffff;
  v = (v | v << 32) & 0x1f00000000ffffULL;
  v = (v | v << 16) & 0x1f0000ff0000ffULL;
  v = (v | v << 8) & 0x100f00f00f00f00fULL;
  v = (v | v << 4) & 0x10c30c30c30c30c3ULL;
  return (v | v << 2) & 0x1249249249249249ULL;
}

std::uint64_t compact_bits(std::uint64_t v) {
  v &= 0x1249249249249249ULL;
  v = (v | v >> 2) & 0x10c30c30c30c30c3ULL;
  v = (v | v >> 4) & 0x100f00f00f00f00fULL;
  v = (v | v >> 8) & 0x1f0000ff0000ffULL;
  v = (v | v >> 16) & 0x1f00000000ffffULL;
  return (v | v >> 32) & 0x1fffff;
}

using Cell = std::array<std::int64_t, 3>;

std::uint64_t key_of(const Cell& c) {
  return spread_bits(static_cast<std::uint64_t>(c[0])) | spread_bits(static_cast<std::uint64_t>(c[1])) << 1 |
         spread_bits(static_cast<std::uint64_t>(c[2])) << 2;
}

Cell cell_of(std::uint64_t key) {
  return {static_cast<std::int64_t>(compact_bits(key)), static_cast<std::int64_t>(compact_bits(key >> 1)),
          static_cast<std::int64_t>(compact_bits(key >> 2))};
}

struct Keyed {
  std::uint64_t key;
  std::uint32_t index;
};

/// Stable radix sort by key, as many passes as the largest key has digits.
void sort_by_key(std::vector<Keyed>& items) {
  constexpr int kDigit = 11;
  std::uint64_t all = 0;
  for (const Keyed& k : items) all |= k.key;
  std::vector<Keyed> other(items.size());
  for (int shift = 0; shift < static_cast<int>(std::bit_width(all)); shift += kDigit) {
    std::array<std::uint32_t, (1 << kDigit) + 1> start{};
    const auto digit = [shift](const Keyed& k) { return static_cast<std::size_t>(k.key >> shift & ((1 << kDigit) - 1)); };
    for (const Keyed& k : items) ++start[digit(k) + 1];
    for (std::size_t d = 1; d < start.size(); ++d) start[d] += start[d - 1];
    for (const Keyed& k : items) other[start[digit(k)]++] = k;
    items.swap(other);
  }
}

/// A lattice of cells that halves from level to level, the finest with 2^kAxisBits cells along the longest side at most.
struct Lattice {
  Vec3 origin;
  double finest;  // cell size of level 0

  Lattice(const field::Positions& x, double wanted) {
    Vec3 lo = x[0], hi = x[0];
    for (std::size_t i = 1; i < x.size; ++i) {
      lo = lo.cwiseMin(x[i]);
      hi = hi.cwiseMax(x[i]);
    }
    origin = lo;
    finest = std::max(wanted, (hi - lo).maxCoeff() / ((1 << kAxisBits) - 2));
    if (!(finest > 0)) finest = 1;
  }
  double size(int level) const { return std::ldexp(finest, level); }
  /// The finest level whose cells are as large as `reach`.
  int level(double reach) const {
    if (reach <= finest) return 0;
    const int below = std::ilogb(reach / finest);
    return size(below) >= reach ? below : below + 1;
  }
  Cell cell(const Vec3& p, int level) const {
    const double inverse = 1 / size(level);
    Cell c;
    for (int a = 0; a < 3; ++a) c[static_cast<std::size_t>(a)] = static_cast<std::int64_t>((p[a] - origin[a]) * inverse);
    return c;
  }
};

/// The particles of one level in Z-order, their cells, and a hash from cell to place.
struct Level {
  int number = 0;
  std::vector<Keyed> items;
  std::vector<double> x, y, z, reach2;
  std::vector<std::uint64_t> cell_key;    // rising
  std::vector<std::uint32_t> cell_begin;  // one more than cells
  std::vector<std::uint32_t> table;       // open addressing: cell number or kNone
  std::uint64_t mask = 0;

  void finish(const field::Positions& p, std::span<const double> reach) {
    sort_by_key(items);
    const std::size_t n = items.size();
    for (auto* a : {&x, &y, &z, &reach2}) a->resize(n);
    for (std::size_t k = 0; k < n; ++k) {
      const std::uint32_t i = items[k].index;
      x[k] = p.x[i];
      y[k] = p.y[i];
      z[k] = p.z[i];
      reach2[k] = reach[i] * reach[i];
      if (k > 0 && items[k].key == items[k - 1].key) continue;
      cell_key.push_back(items[k].key);
      cell_begin.push_back(static_cast<std::uint32_t>(k));
    }
    cell_begin.push_back(static_cast<std::uint32_t>(n));
    mask = std::bit_ceil(2 * cell_key.size() + 1) - 1;
    table.assign(mask + 1, kNone);
    for (std::size_t c = 0; c < cell_key.size(); ++c) {
      std::uint64_t slot = hash(cell_key[c]);
      while (table[slot] != kNone) slot = (slot + 1) & mask;
      table[slot] = static_cast<std::uint32_t>(c);
    }
  }
  std::uint64_t hash(std::uint64_t key) const { return (key * 0x9e3779b97f4a7c15ULL >> 20) & mask; }

  struct Range {
    std::uint32_t begin, end;
  };
  /// Particles of this level in the cell `key` of a level `coarser` steps up.
  Range range(std::uint64_t key, int coarser) const {
    if (coarser > 0) {
      const auto at = [&](std::uint64_t k) {
        return static_cast<std::size_t>(std::lower_bound(cell_key.begin(), cell_key.end(), k) - cell_key.begin());
      };
      return {cell_begin[at(key << 3 * coarser)], cell_begin[at((key + 1) << 3 * coarser)]};
    }
    for (std::uint64_t slot = hash(key); table[slot] != kNone; slot = (slot + 1) & mask)
      if (cell_key[table[slot]] == key) return {cell_begin[table[slot]], cell_begin[table[slot] + 1]};
    return {0, 0};
  }
};

std::vector<Level> make_levels(const field::Positions& x, std::span<const double> reach, const RunControl& run) {
  // Level cells are at least as large as the reaches in them; the common reach just fits its cell.
  std::vector<double> sorted(reach.begin(), reach.end());
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double common = std::min(1.25 * *middle, *std::max_element(reach.begin(), reach.end()));
  const double smallest = *std::min_element(reach.begin(), reach.end());
  const int below = smallest < common ? static_cast<int>(std::floor(std::log2(common / smallest))) : 0;
  const Lattice lattice(x, std::ldexp(common, -below));
  const int coarsest = lattice.level(*std::max_element(reach.begin(), reach.end()));
  std::vector<std::uint16_t> numbers(x.size);
  std::vector<std::uint64_t> key(x.size);
  parallel_for(x.size, 4096, run, [&](std::size_t i) {
    const int level = lattice.level(reach[i]);
    numbers[i] = static_cast<std::uint16_t>(level);
    key[i] = key_of(lattice.cell(x[i], level));
  });
  std::vector<Level> by_number(static_cast<std::size_t>(coarsest) + 1);
  for (std::size_t i = 0; i < x.size; ++i) by_number[numbers[i]].items.push_back({key[i], static_cast<std::uint32_t>(i)});
  std::vector<Level> levels;
  for (std::size_t number = 0; number < by_number.size(); ++number) {
    if (by_number[number].items.empty()) continue;
    by_number[number].number = static_cast<int>(number);
    by_number[number].finish(x, reach);
    levels.push_back(std::move(by_number[number]));
  }
  return levels;
}

/// The ranges of `other` that can hold neighbours of the particles in cell `c` of level `number`.
void near_ranges(const Level& other, const Cell& c, int number, std::vector<Level::Range>& out) {
  const int level = std::max(number, other.number);
  for (std::int64_t dz = -1; dz <= 1; ++dz)
    for (std::int64_t dy = -1; dy <= 1; ++dy)
      for (std::int64_t dx = -1; dx <= 1; ++dx) {
        const int up = level - number;
        const Cell d = {(c[0] >> up) + dx, (c[1] >> up) + dy, (c[2] >> up) + dz};
        if (d[0] < 0 || d[1] < 0 || d[2] < 0) continue;
        const Level::Range r = other.range(key_of(d), level - other.number);
        if (r.begin < r.end) out.push_back(r);
      }
}

/// Particles that can be near those of a cell, side by side.
struct Candidates {
  std::vector<double> x, y, z, reach2, beyond;
  std::vector<std::uint32_t> index;

  void clear() {
    for (auto* a : {&x, &y, &z, &reach2}) a->clear();
    index.clear();
  }
  void add(const Level& level, Level::Range r) {
    const auto part = [r](auto& to, const auto& from) { to.insert(to.end(), from.begin() + r.begin, from.begin() + r.end); };
    part(x, level.x);
    part(y, level.y);
    part(z, level.z);
    part(reach2, level.reach2);
    for (std::uint32_t k = r.begin; k < r.end; ++k) index.push_back(level.items[k].index);
  }
  /// Appends those near particle `self` at p to `out`.
  void append_near(const Vec3& p, double self_reach2, std::uint32_t self, std::vector<std::uint32_t>& out) {
    const std::size_t n = index.size();
    beyond.resize(n);
    const double px = p.x(), py = p.y(), pz = p.z();
    for (std::size_t k = 0; k < n; ++k) {
      const double dx = x[k] - px, dy = y[k] - py, dz = z[k] - pz;
      const double limit = self_reach2 > reach2[k] ? self_reach2 : reach2[k];
      beyond[k] = dx * dx + dy * dy + dz * dz - limit;
    }
    std::size_t kept = out.size();
    out.resize(kept + n);
    for (std::size_t k = 0; k < n; ++k) {
      out[kept] = index[k];
      kept += static_cast<int>(beyond[k] < 0) & static_cast<int>(index[k] != self);
    }
    out.resize(kept);
  }
};

}  // namespace

Neighbours find_neighbours(const field::Positions& x, std::span<const double> reach, const RunControl& run) {
  Neighbours result;
  result.first.resize(x.size);
  result.count.resize(x.size);
  if (x.size == 0) return result;
  const std::vector<Level> levels = make_levels(x, reach, run);

  for (const Level& level : levels) {
    // Each block of cells fills a buffer of its own; the buffers are then laid end to end in block order.
    const std::size_t cells = level.cell_key.size();
    std::vector<std::vector<std::uint32_t>> found((cells + kCellBlock - 1) / kCellBlock);
    parallel_blocks(cells, kCellBlock, run, [&](std::size_t begin, std::size_t end) {
      std::vector<std::uint32_t>& list = found[begin / kCellBlock];
      std::vector<Level::Range> ranges;
      Candidates near;
      for (std::size_t c = begin; c < end; ++c) {
        near.clear();
        for (const Level& other : levels) {
          ranges.clear();
          near_ranges(other, cell_of(level.cell_key[c]), level.number, ranges);
          for (const Level::Range r : ranges) near.add(other, r);
        }
        for (std::uint32_t k = level.cell_begin[c]; k < level.cell_begin[c + 1]; ++k) {
          const std::uint32_t i = level.items[k].index;
          result.first[i] = list.size();
          near.append_near({level.x[k], level.y[k], level.z[k]}, level.reach2[k], i, list);
          result.count[i] = static_cast<std::uint32_t>(list.size() - result.first[i]);
        }
      }
    });
    std::vector<std::size_t> offset(found.size() + 1, result.index.size());
    for (std::size_t b = 0; b < found.size(); ++b) offset[b + 1] = offset[b] + found[b].size();
    result.index.resize(offset.back());
    parallel_for(found.size(), 1, run, [&](std::size_t b) {
      std::copy(found[b].begin(), found[b].end(), result.index.begin() + static_cast<std::ptrdiff_t>(offset[b]));
      const std::size_t last = std::min(cells, (b + 1) * kCellBlock);
      for (std::uint32_t k = level.cell_begin[b * kCellBlock]; k < level.cell_begin[last]; ++k)
        result.first[level.items[k].index] += offset[b];
    });
  }
  return result;
}

std::vector<std::uint32_t> spatial_order(const field::Positions& x, double cell) {
  std::vector<Keyed> items(x.size);
  std::vector<std::uint32_t> order(x.size);
  if (x.size == 0) return order;
  const Lattice lattice(x, cell);
  for (std::size_t i = 0; i < x.size; ++i) items[i] = {key_of(lattice.cell(x[i], 0)), static_cast<std::uint32_t>(i)};
  sort_by_key(items);
  for (std::size_t k = 0; k < items.size(); ++k) order[k] = items[k].index;
  return order;
}

}  // namespace meniscus::sample
