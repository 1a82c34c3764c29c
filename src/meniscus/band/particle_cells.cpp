#include <meniscus/band/particle_cells.h>

#include <algorithm>
#include <cmath>

namespace meniscus::band {

ParticleCells::ParticleCells(std::span<const Vec3> points, double cell) : cell_(cell) {
  if (!points.empty()) {
    // The middle of the points by the median per axis: a stray must not decide.
    std::vector<double> c(points.size());
    for (int a = 0; a < 3; ++a) {
      for (std::size_t i = 0; i < c.size(); ++i) c[i] = points[i][a];
      const auto middle = c.begin() + static_cast<std::ptrdiff_t>(c.size() / 2);
      std::nth_element(c.begin(), middle, c.end());
      origin_[a] = cell * std::floor(*middle / cell);
    }
  }
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keyed;
  keyed.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!(((points[i] - origin_) / cell).cwiseAbs().maxCoeff() < 1e6)) {
      ++left_out_;
      continue;
    }
    const auto c = cell_of(points[i]);
    keyed.emplace_back(key(c[0], c[1], c[2]), static_cast<std::uint32_t>(i));
  }
  std::sort(keyed.begin(), keyed.end());
  order_.reserve(keyed.size());
  for (const auto& [k, i] : keyed) {
    if (keys_.empty() || keys_.back() != k) {
      keys_.push_back(k);
      begin_.push_back(static_cast<std::uint32_t>(order_.size()));
    }
    order_.push_back(i);
  }
  begin_.push_back(static_cast<std::uint32_t>(order_.size()));
}

std::array<std::int64_t, 3> ParticleCells::cell_of(const Vec3& p) const {
  const auto c = [&](int a) {
    return static_cast<std::int64_t>(std::clamp(std::floor((p[a] - origin_[a]) / cell_), -1.04e6, 1.04e6));
  };
  return {c(0), c(1), c(2)};
}

std::pair<std::size_t, std::size_t> ParticleCells::run(std::uint64_t first, std::uint64_t last) const {
  const auto low = std::lower_bound(keys_.begin(), keys_.end(), first);
  const auto high = std::upper_bound(low, keys_.end(), last);
  return {begin_[static_cast<std::size_t>(low - keys_.begin())], begin_[static_cast<std::size_t>(high - keys_.begin())]};
}

std::vector<Box> ParticleCells::boxes() const {
  std::vector<Box> out;
  out.reserve(keys_.size());
  for (const std::uint64_t k : keys_) {
    const auto part = [&](int shift) {
      return static_cast<double>(static_cast<std::int64_t>(k >> shift & 0x1FFFFF) - kHalf);
    };
    const Vec3 low = origin_ + cell_ * Vec3(part(42), part(21), part(0));
    out.push_back({low, low + Vec3::Constant(cell_)});
  }
  return out;
}

}  // namespace meniscus::band
