#include <meniscus/band/band.h>
#include <meniscus/band/kernels.h>
#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>

#include <algorithm>
#include <cmath>
#include <cstring>
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

Coord moved(const Coord& c, int dx, int dy, int dz) { return {c[0] + dx, c[1] + dy, c[2] + dz}; }

/// Along one axis, the own node that is nearest to a neighbour in direction d.
int edge_node(int d) { return d < 0 ? 0 : d > 0 ? 7 : 4; }

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
  std::uint32_t zones = 0;
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 8; ++j) {
      const float* row = values + (i * 8 + j) * 8;
      const std::size_t zone = Band::direction(i == 0 ? -1 : i == 7, j == 0 ? -1 : j == 7, 0);
      bool middle = false;
      for (int k = 1; k < 7; ++k) middle |= std::abs(row[k]) < background;
      zones |= static_cast<std::uint32_t>(std::abs(row[0]) < background) << (zone - 1) |
               static_cast<std::uint32_t>(middle) << zone |
               static_cast<std::uint32_t>(std::abs(row[7]) < background) << (zone + 1);
    }
  std::uint32_t touched = 0;
  for (std::size_t zone = 0; zone < 27; ++zone)
    if ((zones >> zone & 1u) != 0) touched |= kZoneBorders[zone];
  return touched;
}

/// A brick to be: where its samples come from, or the side it lies on.
struct Wanted {
  Coord coord;
  std::int32_t from;  // brick now, kOutside or kInside
};

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
    if (bricks_[slots_[s] - 1] == brick) return static_cast<std::int32_t>(slots_[s] - 1);
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

void Band::link(const RunControl& run) {
  neighbours_.resize(bricks_.size());
  parallel_for(bricks_.size(), 64, run, [&](std::size_t b) {
    for (int dx = -1; dx <= 1; ++dx)
      for (int dy = -1; dy <= 1; ++dy)
        for (int dz = -1; dz <= 1; ++dz) {
          std::int32_t n = find(moved(bricks_[b], dx, dy, dz));
          if (n < 0) {
            const int node = (edge_node(dx) * 8 + edge_node(dy)) * 8 + edge_node(dz);
            n = values_[b * kBrickNodes + static_cast<std::size_t>(node)] < 0 ? kInside : kOutside;
          }
          neighbours_[b][direction(dx, dy, dz)] = n;
        }
  });
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

float Band::node(std::int64_t i, std::int64_t j, std::int64_t k, bool& known) const {
  const Coord brick = {static_cast<std::int32_t>(i >> 3), static_cast<std::int32_t>(j >> 3),
                       static_cast<std::int32_t>(k >> 3)};
  const std::int32_t b = find(brick);
  if (b >= 0)
    return values_[static_cast<std::size_t>(b) * kBrickNodes +
                   static_cast<std::size_t>(((i & 7) * 8 + (j & 7)) * 8 + (k & 7))];
  known = false;
  return far_value(brick);
}

double Band::sample(const Vec3& x, bool* known) const {
  bool all = true;
  const Vec3 c = ((x - origin_) / voxel_).cwiseMax(-1e9).cwiseMin(1e9);
  const Vec3 low = c.array().floor();
  const Vec3 f = c - low;
  const auto i = static_cast<std::int64_t>(low.x()), j = static_cast<std::int64_t>(low.y()),
             k = static_cast<std::int64_t>(low.z());
  double sum = 0;
  for (int q = 0; q < 8; ++q) {
    const int a = q >> 2, b = q >> 1 & 1, d = q & 1;
    const double w = (a ? f.x() : 1 - f.x()) * (b ? f.y() : 1 - f.y()) * (d ? f.z() : 1 - f.z());
    sum += w * static_cast<double>(node(i + a, j + b, k + d, all));
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
    float halo[kHaloSize];
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

  std::vector<Wanted> wanted;
  bool same = true;
  for (std::size_t b = 0; b < bricks_.size(); ++b) {
    if (reached[b] == 0) continue;
    for (int dx = -1; dx <= 1; ++dx)
      for (int dy = -1; dy <= 1; ++dy)
        for (int dz = -1; dz <= 1; ++dz) {
          const std::size_t d = direction(dx, dy, dz);
          if ((reached[b] >> d & 1u) == 0) continue;
          const std::int32_t n = d == direction(0, 0, 0) ? static_cast<std::int32_t>(b) : neighbours_[b][d];
          same &= n >= 0;
          // A neighbour that is active itself asks for its own place.
          if (n < 0 || d == direction(0, 0, 0) || reached[static_cast<std::size_t>(n)] == 0)
            wanted.push_back({moved(bricks_[b], dx, dy, dz), n});
        }
  }
  std::sort(wanted.begin(), wanted.end(),
            [](const Wanted& a, const Wanted& b) { return a.coord != b.coord ? a.coord < b.coord : a.from > b.from; });
  wanted.erase(
      std::unique(wanted.begin(), wanted.end(), [](const Wanted& a, const Wanted& b) { return a.coord == b.coord; }),
      wanted.end());
  if (same && wanted.size() == bricks_.size()) return {};

  std::vector<std::int32_t> map(wanted.size());
  std::vector<Coord> bricks(wanted.size());
  std::vector<float> values(wanted.size() * kBrickNodes);
  for (std::size_t b = 0; b < wanted.size(); ++b) {
    bricks[b] = wanted[b].coord;
    map[b] = std::max(wanted[b].from, -1);
    float* to = values.data() + b * kBrickNodes;
    if (map[b] >= 0)
      std::memcpy(to, values_.data() + static_cast<std::size_t>(map[b]) * kBrickNodes, kBrickNodes * sizeof(float));
    else
      std::fill(to, to + kBrickNodes, wanted[b].from == kInside ? -background_ : background_);
  }
  bricks_.swap(bricks);
  values_.swap(values);
  index();
  link(run);
  return map;
}

void gather_halo(const Band& band, const float* data, std::size_t brick, float outside, float inside, float* halo) {
  // Where no brick is, every row is one and the same row of constants.
  struct Source {
    const float* p;
    int scale;
  };
  float blank[2][8];
  std::fill(blank[0], blank[0] + 8, outside);
  std::fill(blank[1], blank[1] + 8, inside);
  Source source[27];
  const Band::Neighbours& nb = band.neighbours(brick);
  for (std::size_t d = 0; d < 27; ++d)
    source[d] = nb[d] >= 0 ? Source{data + static_cast<std::size_t>(nb[d]) * Band::kBrickNodes, 1}
                           : Source{blank[nb[d] == Band::kInside], 0};
  for (int i = -2; i < 10; ++i) {
    const int dx = i < 0 ? -1 : i > 7;
    for (int j = -2; j < 10; ++j) {
      const int dy = j < 0 ? -1 : j > 7;
      const int row = ((i & 7) * 8 + (j & 7)) * 8;
      const Source* s = source + Band::direction(dx, dy, 0);
      const float *before = s[-1].p + s[-1].scale * row, *own = s[0].p + s[0].scale * row,
                  *after = s[1].p + s[1].scale * row;
      float* to = halo + halo_at(i, j, -2);
      std::memcpy(to, before + 6, 2 * sizeof(float));
      std::memcpy(to + 2, own, 8 * sizeof(float));
      std::memcpy(to + 10, after, 2 * sizeof(float));
    }
  }
}

bool holds_surface(const float* halo) {
  int inside = 0;
  for (int i = 0; i < 9; ++i)
    for (int j = 0; j < 9; ++j)
      for (int k = 0; k < 9; ++k) inside += halo[halo_at(i, j, k)] < 0;
  return inside != 0 && inside != 729;
}

}  // namespace meniscus::band
