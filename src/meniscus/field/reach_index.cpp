#include <meniscus/field/reach_index.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace meniscus::field {
namespace {

constexpr std::uint32_t kEmpty = 0xffffffffu;
constexpr std::int64_t kWindow = 2;  // cells on each side, cells being half the largest radius
constexpr int kMaxLevels = 24;
constexpr std::size_t kFew = 24;  // so few are all candidates, without a search

std::int64_t floor_to_cell(double x, double cell) {
  // Kept within what shifts and windows can bear; only absurd ratios of extent to radius come near.
  return static_cast<std::int64_t>(std::clamp(std::floor(x / cell), -4e17, 4e17));
}

}  // namespace

ReachIndex::ReachIndex(std::span<const double> x, std::span<const double> y, std::span<const double> z,
                       std::span<const double> reach) {
  double largest = 0;
  double smallest = std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < reach.size(); ++i) {
    if (!(reach[i] > 0) || !std::isfinite(reach[i] + x[i] + y[i] + z[i])) continue;
    order_.push_back(i);
    largest = std::max(largest, reach[i]);
    smallest = std::min(smallest, reach[i]);
    bounds_.extend(Box::around({x[i], y[i], z[i]}, reach[i]));
  }
  if (order_.empty()) return;

  // Level l holds radii in (largest/2^(l+1), largest/2^l]; the finest level has shift 0.
  const int finest = std::min(kMaxLevels - 1, static_cast<int>(std::floor(std::log2(largest / smallest))));
  finest_ = 0.5 * std::ldexp(largest, -finest);
  for (int l = 0; l <= finest; ++l) levels_.push_back({finest - l, 0.5 * std::ldexp(largest, -l)});

  std::vector<std::array<std::int64_t, 4>> keys(reach.size());
  for (const std::uint32_t i : order_) {
    const int l = std::clamp(static_cast<int>(std::floor(std::log2(largest / reach[i]))), 0, finest);
    const Cell c = cell({x[i], y[i], z[i]});
    const int shift = levels_[static_cast<std::size_t>(l)].shift;
    keys[i] = {l, c[0] >> shift, c[1] >> shift, c[2] >> shift};
  }
  std::stable_sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
  build_rows(keys);
}

void ReachIndex::build_rows(const std::vector<std::array<std::int64_t, 4>>& keys) {
  z_.resize(order_.size());
  for (std::uint32_t k = 0; k < order_.size(); ++k) {
    const auto& [level, x, y, z] = keys[order_[k]];
    z_[k] = z;
    if (rows_.empty() || rows_.back().level != level || rows_.back().x != x || rows_.back().y != y)
      rows_.push_back({level, x, y, {k, k}});
    rows_.back().range.end = k + 1;
  }
  std::size_t size = 16;
  while (size < 2 * rows_.size()) size *= 2;
  table_.assign(size, kEmpty);
  for (std::uint32_t r = 0; r < rows_.size(); ++r) {
    std::size_t slot = hash(rows_[r].level, rows_[r].x, rows_[r].y) & (size - 1);
    while (table_[slot] != kEmpty) slot = (slot + 1) & (size - 1);
    table_[slot] = r;
  }
}

std::uint64_t ReachIndex::hash(std::int64_t level, std::int64_t x, std::int64_t y) {
  std::uint64_t h = static_cast<std::uint64_t>(x) * 0x9e3779b97f4a7c15u +
                    static_cast<std::uint64_t>(y) * 0xc2b2ae3d27d4eb4fu +
                    static_cast<std::uint64_t>(level) * 0x165667b19e3779f9u;
  h ^= h >> 29;
  h *= 0xbf58476d1ce4e5b9u;
  return h ^ (h >> 32);
}

ReachIndex::Cell ReachIndex::cell(const Vec3& p) const {
  return {floor_to_cell(p.x(), finest_), floor_to_cell(p.y(), finest_), floor_to_cell(p.z(), finest_)};
}

const ReachIndex::Row* ReachIndex::find_row(std::int64_t level, std::int64_t x, std::int64_t y) const {
  const std::size_t mask = table_.size() - 1;
  for (std::size_t slot = hash(level, x, y) & mask; table_[slot] != kEmpty; slot = (slot + 1) & mask) {
    const Row& row = rows_[table_[slot]];
    if (row.level == level && row.x == x && row.y == y) return &row;
  }
  return nullptr;
}

void ReachIndex::append(const Row& row, std::int64_t z_min, std::int64_t z_max, std::vector<Range>& out) const {
  const auto first = z_.begin() + row.range.begin, last = z_.begin() + row.range.end;
  const auto lo = std::lower_bound(first, last, z_min);
  const auto hi = std::upper_bound(lo, last, z_max);
  if (lo != hi) out.push_back({static_cast<std::uint32_t>(lo - z_.begin()), static_cast<std::uint32_t>(hi - z_.begin())});
}

void ReachIndex::candidates(const Cell& cell, std::vector<Range>& out) const {
  for (std::size_t l = 0; l < levels_.size(); ++l) {
    const int shift = levels_[l].shift;
    const std::int64_t cx = cell[0] >> shift, cy = cell[1] >> shift, cz = cell[2] >> shift;
    for (std::int64_t x = cx - kWindow; x <= cx + kWindow; ++x)
      for (std::int64_t y = cy - kWindow; y <= cy + kWindow; ++y)
        if (const Row* row = find_row(static_cast<std::int64_t>(l), x, y)) append(*row, cz - kWindow, cz + kWindow, out);
  }
}

void ReachIndex::for_groups(const Positions& x,
                            FunctionRef<void(std::span<const Range>, std::span<const std::uint32_t>)> visit) const {
  std::vector<Range> ranges;
  std::vector<std::uint32_t> group;
  const auto count = static_cast<std::uint32_t>(order_.size());

  // Points by cell: a hash brings equal cells together, with the point's number in its low half so that plain integers are
  // sorted; cells themselves are compared.
  std::vector<std::uint64_t> keys;
  std::vector<Cell> cells(x.size);
  for (std::uint32_t i = 0; i < x.size; ++i) {
    const Vec3 p = x[i];
    if (count == 0 || !bounds_.contains(p)) {
      group.push_back(i);
      continue;
    }
    cells[i] = count <= kFew ? Cell{0, 0, 0} : cell(p);
    const auto mix = static_cast<std::uint64_t>(cells[i][0]) * 0x9e3779b97f4a7c15u ^
                     static_cast<std::uint64_t>(cells[i][1]) * 0xc2b2ae3d27d4eb4fu ^
                     static_cast<std::uint64_t>(cells[i][2]) * 0x165667b19e3779f9u;
    keys.push_back((mix & 0xffffffff00000000u) | i);
  }
  if (!group.empty()) visit(ranges, group);

  std::sort(keys.begin(), keys.end());
  const auto point = [&](std::size_t k) { return static_cast<std::uint32_t>(keys[k] & 0xffffffffu); };
  for (std::size_t k = 0; k < keys.size();) {
    const Cell shared = cells[point(k)];
    ranges.clear();
    group.clear();
    if (count <= kFew)
      ranges.push_back({0, count});
    else
      candidates(shared, ranges);
    for (; k < keys.size() && cells[point(k)] == shared; ++k) group.push_back(point(k));
    visit(ranges, group);
  }
}

bool ReachIndex::overlapping(const Box& box, std::size_t most, std::vector<Range>& out) const {
  if (order_.empty() || !box.overlaps(bounds_)) return true;
  const Cell lo = cell(box.min.cwiseMax(bounds_.min)), hi = cell(box.max.cwiseMin(bounds_.max));
  std::size_t found = 0;
  for (std::size_t l = 0; l < levels_.size(); ++l) {
    const int shift = levels_[l].shift;
    std::array<std::int64_t, 3> a, b;
    for (std::size_t i = 0; i < 3; ++i) {
      a[i] = (lo[i] >> shift) - kWindow;
      b[i] = (hi[i] >> shift) + kWindow;
    }
    const auto visit = [&](const Row& row) {
      const std::size_t before = out.size();
      append(row, a[2], b[2], out);
      if (out.size() > before) found += out.back().end - out.back().begin;
      return found <= most;
    };
    const double columns = static_cast<double>(b[0] - a[0] + 1) * static_cast<double>(b[1] - a[1] + 1);
    if (columns > static_cast<double>(rows_.size())) {
      for (const Row& row : rows_)
        if (row.level == static_cast<std::int64_t>(l) && row.x >= a[0] && row.x <= b[0] && row.y >= a[1] && row.y <= b[1] &&
            !visit(row))
          return false;
      continue;
    }
    for (std::int64_t x = a[0]; x <= b[0]; ++x)
      for (std::int64_t y = a[1]; y <= b[1]; ++y)
        if (const Row* row = find_row(static_cast<std::int64_t>(l), x, y); row != nullptr && !visit(*row)) return false;
  }
  return true;
}

}  // namespace meniscus::field
