#include <meniscus/field/grid.h>

#include <meniscus/base/error.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

namespace meniscus::field {

namespace {

constexpr std::int32_t kFarthestBrick = 1 << 27;  // voxel indices and stencils about them stay within int32

std::uint64_t hash(const Coord& c) {
  std::uint64_t h = static_cast<std::uint32_t>(c[0]) * 0x9E3779B97F4A7C15ull;
  h = (h ^ (h >> 29) ^ static_cast<std::uint32_t>(c[1])) * 0xBF58476D1CE4E5B9ull;
  h = (h ^ (h >> 32) ^ static_cast<std::uint32_t>(c[2])) * 0x94D049BB133111EBull;
  return h ^ (h >> 31);
}

std::string text(const Coord& c) {
  std::string s = std::to_string(c[0]);
  for (const std::size_t a : {1u, 2u}) s.append(", ").append(std::to_string(c[a]));
  return s;
}

void require(bool fact, const std::string& message) {
  if (!fact) throw InvalidInput("grid: " + message);
}

bool sensible(double length) { return length >= 1e-100 && length <= 1e100; }  // false for NaN

}  // namespace

Grid::Grid(double voxel, Vec3 origin, double background, std::vector<Coord> bricks, std::vector<float> values)
    : voxel_(voxel),
      origin_(std::move(origin)),
      background_(background),
      bricks_(std::move(bricks)),
      values_(std::move(values)) {
  require(sensible(voxel_), "voxel size must be positive and finite, not " + std::to_string(voxel_));
  require(sensible(background_) && background_ <= std::numeric_limits<float>::max() && static_cast<float>(background_) > 0,
          "background must be positive and finite, not " + std::to_string(background_));
  require(origin_.allFinite(), "origin is not finite");
  require(values_.size() == bricks_.size() * kBrickVoxels && values_.size() / kBrickVoxels == bricks_.size(),
          std::to_string(bricks_.size()) + " bricks need 512 values each, " + std::to_string(values_.size()) + " given");
  require(bricks_.size() < std::numeric_limits<std::uint32_t>::max(), "too many bricks");
  for (const Coord& c : bricks_)
    if (std::any_of(c.begin(), c.end(), [](std::int32_t i) { return i < -kFarthestBrick || i > kFarthestBrick; }))
      throw InvalidInput("grid: brick (" + text(c) + ") is too far out");

  const auto filler = static_cast<float>(background_);
  background_ = filler;
  for (float& v : values_)
    if (!std::isfinite(v)) v = filler;
  sort_bricks();
  build_index();
}

void Grid::sort_bricks() {
  if (!std::is_sorted(bricks_.begin(), bricks_.end())) {
    std::vector<std::size_t> order(bricks_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return bricks_[a] < bricks_[b]; });

    std::vector<Coord> bricks(bricks_.size());
    std::vector<float> values(values_.size());
    for (std::size_t n = 0; n < order.size(); ++n) {
      bricks[n] = bricks_[order[n]];
      std::copy_n(values_.data() + order[n] * kBrickVoxels, kBrickVoxels, values.data() + n * kBrickVoxels);
    }
    bricks_ = std::move(bricks);
    values_ = std::move(values);
  }
  const auto twice = std::adjacent_find(bricks_.begin(), bricks_.end());
  if (twice != bricks_.end()) throw InvalidInput("grid: brick (" + text(*twice) + ") is given twice");
}

void Grid::build_index() {
  std::size_t places = 1;
  while (places < 2 * bricks_.size()) places *= 2;
  index_.assign(places, 0);
  for (std::size_t b = 0; b < bricks_.size(); ++b) {
    std::size_t place = hash(bricks_[b]) & (places - 1);
    while (index_[place] != 0) place = (place + 1) & (places - 1);
    index_[place] = static_cast<std::uint32_t>(b + 1);
  }
}

std::size_t Grid::find(const Coord& brick_index) const {
  if (bricks_.empty()) return 0;
  const std::size_t mask = index_.size() - 1;
  for (std::size_t place = hash(brick_index) & mask; index_[place] != 0; place = (place + 1) & mask)
    if (bricks_[index_[place] - 1] == brick_index) return index_[place] - 1;
  return bricks_.size();
}

Grid::View Grid::view(const Coord& brick_index) const {
  View result{nullptr, nullptr, static_cast<float>(background_)};
  const std::size_t b = find(brick_index);
  if (b < bricks_.size()) {
    result.samples = values_.data() + b * kBrickVoxels;
    return result;
  }
  // Bricks are sorted, so the next ones below and above in the column are neighbours in the list.
  const auto above = std::lower_bound(bricks_.begin(), bricks_.end(), brick_index);
  const auto same_column = [&](const Coord& c) { return c[0] == brick_index[0] && c[1] == brick_index[1]; };
  if (above == bricks_.begin() || above == bricks_.end()) return result;
  const auto below = above - 1;
  if (!same_column(*below) || !same_column(*above)) return result;

  const bool lower = brick_index[2] - (*below)[2] <= (*above)[2] - brick_index[2];
  const auto nearest = static_cast<std::size_t>((lower ? below : above) - bricks_.begin());
  result.column = values_.data() + nearest * kBrickVoxels + (lower ? kBrick - 1 : 0);
  return result;
}

Box Grid::bounds() const {
  Box box;
  for (const Coord& c : bricks_) {
    const Vec3 first(c[0], c[1], c[2]);
    box.extend(origin_ + voxel_ * kBrick * first);
    box.extend(origin_ + voxel_ * (kBrick * first + Vec3::Constant(kBrick - 1)));
  }
  return box;
}

}  // namespace meniscus::field
