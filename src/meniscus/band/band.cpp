#include <meniscus/band/band.h>
#include <meniscus/band/kernels.h>
#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <numeric>

namespace meniscus::band {
namespace {

std::uint64_t hash(const Coord& c) {
  const auto u = [](std::int32_t v) { return static_cast<std::uint64_t>(static_cast<std::uint32_t>(v)); };
  std::uint64_t h = u(c[0]) * 0x9E3779B97F4A7C15ull ^ u(c[1]) * 0xC2B2AE3D27D4EB4Full ^ u(c[2]) * 0x165667B19E3779F9ull;
  h ^= h >> 29;
  return h * 0xBF58476D1CE4E5B9ull >> 16;
}

bool same(const Coord& a, const Coord& b) { return a[0] == b[0] && a[1] == b[1] && a[2] == b[2]; }  // memcmp is slow

Coord moved(const Coord& c, int dx, int dy, int dz) { return {c[0] + dx, c[1] + dy, c[2] + dz}; }

/// For each zone of a brick (first, middle or last nodes per axis) the directions in which it borders on a neighbour.
constexpr std::array<std::uint32_t, 27> zone_borders() {
  std::array<std::uint32_t, 27> borders{};
  for (int zone = 0; zone < 27; ++zone)
    for (int d = 0; d < 27; ++d) {
      const auto meets = [&](int unit) { return d / unit % 3 == 1 || d / unit % 3 == zone / unit % 3; };
      if (meets(9) && meets(3) && meets(1)) borders[static_cast<std::size_t>(zone)] |= 1u << d;
    }
  return borders;
}
constexpr std::array<std::uint32_t, 27> kZoneBorders = zone_borders();

/// Which of the 27 directions active nodes of a brick touch; the middle bit (itself) when any node is active.
std::uint32_t reach(const float* values, float background) {
  NodeBits active;
  kernels().nearer(values, background, active);
  std::uint64_t middle = 0;
  for (std::size_t i = 1; i < 7; ++i) middle |= active[i];
  const std::uint64_t planes[3] = {active[0], middle, active[7]};
  std::uint32_t touched = 0;
  for (std::size_t x = 0; x < 3; ++x) {
    std::uint64_t rows = planes[x] >> 8 & 0xFFFFFFFFFFFF;
    rows |= rows >> 24;
    rows |= rows >> 16 | rows >> 8;
    const std::uint64_t lines[3] = {planes[x], rows, planes[x] >> 56};
    for (std::size_t y = 0; y < 3; ++y) {
      const std::size_t zone = x * 9 + y * 3;
      if ((lines[y] & 0x01) != 0) touched |= kZoneBorders[zone];
      if ((lines[y] & 0x7E) != 0) touched |= kZoneBorders[zone + 1];
      if ((lines[y] & 0x80) != 0) touched |= kZoneBorders[zone + 2];
    }
  }
  return touched;
}

}  // namespace

Band::Band(double voxel, Vec3 origin) : voxel_(voxel), origin_(std::move(origin)), background_(0) {
  if (!(voxel > 0) || !std::isfinite(voxel)) throw InvalidInput("voxel size must be positive and finite");
  if (!origin_.allFinite()) throw InvalidInput("a grid's origin must be finite");
  background_ = static_cast<float>(kHalfWidth * voxel);
}

Band::Band(double voxel, Vec3 origin, const std::vector<Coord>& bricks, const std::vector<float>& values)
    : Band(voxel, std::move(origin)) {
  if (values.size() != bricks.size() * kBrickNodes) throw InvalidInput("a band needs 512 samples per brick");
  std::vector<std::size_t> order(bricks.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return bricks[a] < bricks[b]; });
  bricks_.reserve(bricks.size());
  values_.reserve(values.size());
  for (const std::size_t b : order) {
    if (!bricks_.empty() && bricks_.back() == bricks[b]) throw InvalidInput("a brick is given twice");
    bricks_.push_back(bricks[b]);
    for (std::size_t n = b * kBrickNodes; n < (b + 1) * kBrickNodes; ++n)
      values_.push_back(std::isnan(values[n]) ? background_ : std::clamp(values[n], -background_, background_));
  }
  index();
  link({});
}

Vec3 Band::position(std::size_t brick, int i, int j, int k) const {
  const Coord& c = bricks_[brick];
  return origin_ + voxel_ * Vec3(8.0 * c[0] + i, 8.0 * c[1] + j, 8.0 * c[2] + k);
}

std::int32_t Band::find(const Coord& brick) const {
  if (slots_.empty()) return -1;
  const std::size_t mask = slots_.size() - 1;
  for (std::size_t s = hash(brick) & mask;; s = (s + 1) & mask) {
    if (slots_[s] == 0) return -1;
    if (same(bricks_[slots_[s] - 1], brick)) return static_cast<std::int32_t>(slots_[s] - 1);
  }
}

std::size_t Band::active_nodes() const {
  return static_cast<std::size_t>(
      std::count_if(values_.begin(), values_.end(), [this](float v) { return std::abs(v) < background_; }));
}

void Band::index() {
  std::size_t size = 16;
  while (size < 2 * bricks_.size()) size *= 2;
  slots_.assign(size, 0);
  for (std::size_t b = 0; b < bricks_.size(); ++b) {
    std::size_t s = hash(bricks_[b]) & (size - 1);
    while (slots_[s] != 0) s = (s + 1) & (size - 1);
    slots_[s] = static_cast<std::uint32_t>(b + 1);
  }
}

/// The side of a place without a brick: that of the own node nearest to it.
std::int32_t Band::side(std::size_t brick, std::size_t d) const {
  const auto edge = [](std::size_t part) {
    return part == 0 ? std::size_t{0} : part == 1 ? std::size_t{4} : std::size_t{7};
  };
  const std::size_t node = (edge(d / 9) * 8 + edge(d / 3 % 3)) * 8 + edge(d % 3);
  return values_[brick * kBrickNodes + node] < 0 ? kInside : kOutside;
}

void Band::link(const RunControl& run) { relink(std::vector<std::int32_t>(bricks_.size(), -1), run); }

/// Finds neighbours anew; what is known of a brick's neighbours before is used. `map` as adapt() returns it.
void Band::relink(const std::vector<std::int32_t>& map, const RunControl& run) {
  std::vector<std::int32_t> now(neighbours_.size(), -1);
  for (std::size_t b = 0; b < map.size(); ++b)
    if (map[b] >= 0) now[static_cast<std::size_t>(map[b])] = static_cast<std::int32_t>(b);
  std::vector<Neighbours> neighbours(bricks_.size());
  parallel_for(bricks_.size(), 64, run, [&](std::size_t b) {
    for (std::size_t d = 0; d < 27; ++d) {
      const int x = static_cast<int>(d);
      std::int32_t n = -1;
      if (map[b] < 0)
        n = find(moved(bricks_[b], x / 9 - 1, x / 3 % 3 - 1, x % 3 - 1));
      else if (const std::int32_t old = neighbours_[static_cast<std::size_t>(map[b])][d]; old >= 0)
        n = now[static_cast<std::size_t>(old)];
      neighbours[b][d] = n >= 0 ? n : side(b, d);
    }
  });
  for (std::size_t b = 0; b < map.size(); ++b)  // what has woken is there for its neighbours, too
    for (std::size_t d = 0; map[b] < 0 && d < 27; ++d)
      if (neighbours[b][d] >= 0)
        neighbours[static_cast<std::size_t>(neighbours[b][d])][26 - d] = static_cast<std::int32_t>(b);
  neighbours_.swap(neighbours);
}

/// ±background for a brick that is not there: what its neighbours say, outside when there are none.
float Band::far_value(const Coord& brick) const {
  for (int d = 0; d < 27; ++d) {
    const int dx = d / 9 - 1, dy = d / 3 % 3 - 1, dz = d % 3 - 1;
    const std::int32_t n = find(moved(brick, -dx, -dy, -dz));
    if (n >= 0)
      return neighbours_[static_cast<std::size_t>(n)][direction(dx, dy, dz)] == kInside ? -background_ : background_;
  }
  return background_;
}

void Band::unite(const Band& other) {
  std::vector<Coord> bricks;
  std::set_union(bricks_.begin(), bricks_.end(), other.bricks_.begin(), other.bricks_.end(), std::back_inserter(bricks));
  std::vector<float> values(bricks.size() * kBrickNodes);
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    const std::int32_t m = find(bricks[b]), o = other.find(bricks[b]);
    const float far_m = m < 0 ? far_value(bricks[b]) : 0, far_o = o < 0 ? other.far_value(bricks[b]) : 0;
    for (std::size_t n = 0; n < kBrickNodes; ++n) {
      const float x = m < 0 ? far_m : values_[static_cast<std::size_t>(m) * kBrickNodes + n];
      const float y = o < 0 ? far_o : other.values_[static_cast<std::size_t>(o) * kBrickNodes + n];
      values[b * kBrickNodes + n] = std::min(x, y);
    }
  }
  bricks_.swap(bricks);
  values_.swap(values);
  index();
  link({});
}

double Band::sample(const Vec3& x, bool* known) const {
  const Vec3 c = ((x - origin_) / voxel_).cwiseMax(-1e9).cwiseMin(1e9);
  const Vec3 low = c.array().floor();
  const Vec3 f = c - low;
  const auto i = static_cast<std::int64_t>(low.x()), j = static_cast<std::int64_t>(low.y()),
             k = static_cast<std::int64_t>(low.z());
  bool all = true;
  double sum = 0;
  Coord looked_up{};
  std::int32_t brick = -1;
  float far = 0;
  for (int q = 0; q < 8; ++q) {
    const std::int64_t node[3] = {i + (q >> 2), j + (q >> 1 & 1), k + (q & 1)};
    const Coord place = {static_cast<std::int32_t>(node[0] >> 3), static_cast<std::int32_t>(node[1] >> 3),
                         static_cast<std::int32_t>(node[2] >> 3)};
    if (q == 0 || !same(place, looked_up)) {  // mostly all eight nodes lie in one brick
      looked_up = place;
      brick = find(place);
      far = brick < 0 ? far_value(place) : 0;
      all = all && brick >= 0;
    }
    const auto n = static_cast<std::size_t>(((node[0] & 7) * 8 + (node[1] & 7)) * 8 + (node[2] & 7));
    const float value = brick < 0 ? far : values_[static_cast<std::size_t>(brick) * kBrickNodes + n];
    const double w = (q >> 2 ? f.x() : 1 - f.x()) * (q >> 1 & 1 ? f.y() : 1 - f.y()) * (q & 1 ? f.z() : 1 - f.z());
    sum += w * static_cast<double>(value);
  }
  if (known != nullptr) *known = all;
  return sum;
}

Vec3 surface_normal(const Band& band, const Vec3& x) {
  Vec3 g;
  for (int a = 0; a < 3; ++a) {
    const Vec3 d = 0.5 * band.voxel() * Vec3::Unit(a);
    g[a] = band.sample(x + d) - band.sample(x - d);
  }
  const double length = g.norm();
  return length > 0 ? Vec3(g / length) : Vec3(Vec3::Zero());
}

void Band::keep_surface(const RunControl& run) {
  std::vector<char> far(bricks_.size());
  parallel_for(bricks_.size(), 16, run, [&](std::size_t b) {
    Halo halo;
    gather_halo(*this, values_.data(), b, background_, -background_, halo);
    int inside = 0;
    for (int i = -2; i < 10; ++i)
      for (int j = -2; j < 10; ++j)
        for (int k = -2; k < 10; ++k) inside += halo[halo_at(i, j, k)] < 0;
    far[b] = inside == 0 || inside == kHaloSide * kHaloSide * kHaloSide;
  });
  for (std::size_t b = 0; b < bricks_.size(); ++b)
    if (far[b] != 0)
      for (std::size_t n = b * kBrickNodes; n < (b + 1) * kBrickNodes; ++n)
        values_[n] = values_[n] < 0 ? -background_ : background_;
  adapt(run);
}

std::vector<std::int32_t> Band::adapt(const RunControl& run) {
  std::vector<std::uint32_t> reached(bricks_.size());
  parallel_for(bricks_.size(), 64, run,
               [&](std::size_t b) { reached[b] = reach(values_.data() + b * kBrickNodes, background_); });

  // Bricks that stay, and places where one is missing with the side that they lie on.
  std::vector<char> stays(bricks_.size(), 0);
  std::vector<std::pair<Coord, std::int32_t>> missing;
  for (std::size_t b = 0; b < bricks_.size(); ++b)
    for (std::uint32_t left = reached[b]; left != 0; left &= left - 1) {
      const int d = std::countr_zero(left);
      const std::int32_t n = d == 13 ? static_cast<std::int32_t>(b) : neighbours_[b][static_cast<std::size_t>(d)];
      if (n >= 0)
        stays[static_cast<std::size_t>(n)] = 1;
      else
        missing.emplace_back(moved(bricks_[b], d / 9 - 1, d / 3 % 3 - 1, d % 3 - 1), n);
    }
  if (missing.empty() && std::find(stays.begin(), stays.end(), 0) == stays.end()) return {};
  std::sort(missing.begin(), missing.end(),
            [](const auto& a, const auto& b) { return a.first != b.first ? a.first < b.first : a.second > b.second; });
  missing.erase(std::unique(missing.begin(), missing.end(), [](const auto& a, const auto& b) { return a.first == b.first; }),
                missing.end());

  // Both lists are in order: the new one is their merger.
  std::vector<std::int32_t> map;
  std::vector<Coord> bricks;
  std::vector<float>& values = spare_.values;
  values.clear();
  const std::size_t count = static_cast<std::size_t>(std::count(stays.begin(), stays.end(), 1)) + missing.size();
  map.reserve(count);
  bricks.reserve(count);
  if (values.capacity() < count * kBrickNodes) values.reserve(count * kBrickNodes * 5 / 4);  // it may grow from step to step
  auto next = missing.begin();
  const auto wake_until = [&](const Coord* end) {
    for (; next != missing.end() && (end == nullptr || next->first < *end); ++next) {
      map.push_back(-1);
      bricks.push_back(next->first);
      values.insert(values.end(), kBrickNodes, next->second == kInside ? -background_ : background_);
    }
  };
  for (std::size_t b = 0; b < bricks_.size(); ++b) {
    if (stays[b] == 0) continue;
    wake_until(&bricks_[b]);
    map.push_back(static_cast<std::int32_t>(b));
    bricks.push_back(bricks_[b]);
    const auto first = values_.begin() + static_cast<std::ptrdiff_t>(b * kBrickNodes);
    values.insert(values.end(), first, first + kBrickNodes);
  }
  wake_until(nullptr);
  bricks_.swap(bricks);
  values_.swap(values);
  index();
  relink(map, run);
  return map;
}

namespace {

/// Where the bricks around a brick lie; beyond them rows are constant.
struct Sources {
  Sources(const Band& band, const float* data, std::size_t brick, float outside, float inside,
          const char* present = nullptr) {
    std::fill(blank[0], blank[0] + 8, outside);
    std::fill(blank[1], blank[1] + 8, inside);
    const Band::Neighbours& nb = band.neighbours(brick);
    for (std::size_t d = 0; d < 27; ++d)
      source[d] = nb[d] >= 0 && (present == nullptr || present[nb[d]] != 0)
                      ? RowSource{data + static_cast<std::size_t>(nb[d]) * Band::kBrickNodes, 8}
                      : RowSource{blank[nb[d] == Band::kInside], 0};
  }
  Sources(const Sources&) = delete;
  Sources& operator=(const Sources&) = delete;

  float blank[2][8];
  RowSource source[27];
};

}  // namespace

void gather_halo(const Band& band, const float* data, std::size_t brick, float outside, float inside, Halo& halo) {
  kernels().gather(Sources(band, data, brick, outside, inside).source, halo);
}

void gather_star(const Band& band, const float* data, std::size_t brick, float outside, float inside, Halo& halo,
                 const char* present) {
  kernels().gather_star(Sources(band, data, brick, outside, inside, present).source, halo);
}

}  // namespace meniscus::band
