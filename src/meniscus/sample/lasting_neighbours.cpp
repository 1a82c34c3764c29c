#include <meniscus/base/parallel.h>
#include <meniscus/sample/lasting_neighbours.h>
#include <meniscus/sample/repulsion.h>

#include <algorithm>
#include <cmath>

namespace meniscus::sample {
namespace {

constexpr double kListed = kRepulsionReach + 0.4;  // radii that lists reach: the repulsion and a skin
constexpr double kTorn = 1.2;                      // of the listed reach: beyond this a particle gets a new list
constexpr double kTooFar = 2;                      // beyond this its neighbours do not know its new neighbours
constexpr std::size_t kBeyond = 100;               // at most one particle of this many may be beyond its skin
constexpr std::size_t kRoom = 8;                   // lists that have grown have room for a multiple of this

Vec3 vec(const std::array<float, 3>& a) { return {a[0], a[1], a[2]}; }

}  // namespace

void LastingNeighbours::find(const SurfacePoints& points, std::span<const double> sigma, const RunControl& run) {
  std::vector<double> reach(sigma.begin(), sigma.end());
  for (double& r : reach) r *= kListed;
  lists_ = find_neighbours(points.positions(), reach, run);
  grown_.clear();
  reach_.assign(reach.begin(), reach.end());
  way_.assign(reach.size(), {});
  found_ = true;
}

bool LastingNeighbours::mend(const SurfacePoints& points, std::span<const double> sigma, const RunControl& run) {
  // Lists that have grown leave holes.
  if (!found_ || 2 * grown_.size() > lists_.index.size()) return false;
  const Wear w = wear(sigma, run);
  if (w.too_far || kBeyond * w.beyond > sigma.size()) return false;
  for (const std::uint32_t i : w.torn) renew(i, points, sigma[i]);
  return true;
}

LastingNeighbours::Wear LastingNeighbours::wear(std::span<const double> sigma, const RunControl& run) const {
  const auto block = [&](std::size_t begin, std::size_t end) {
    Wear w;
    for (std::size_t i = begin; i < end; ++i) {
      const double share = (kRepulsionReach * sigma[i] + 2 * vec(way_[i]).norm()) / static_cast<double>(reach_[i]);
      w.beyond += share > 1;
      w.too_far |= share > kTooFar;
      if (share > kTorn) w.torn.push_back(static_cast<std::uint32_t>(i));
    }
    return w;
  };
  return parallel_reduce(sigma.size(), 4096, run, Wear{}, block, [](Wear a, const Wear& b) {
    a.beyond += b.beyond;
    a.too_far |= b.too_far;
    a.torn.insert(a.torn.end(), b.torn.begin(), b.torn.end());
    return a;
  });
}

/// A new list for particle i, from where it is now.
void LastingNeighbours::renew(std::uint32_t i, const SurfacePoints& points, double sigma) {
  std::vector<std::uint32_t> near;
  for (const std::uint32_t j : of(i)) {
    near.push_back(j);
    near.insert(near.end(), of(j).begin(), of(j).end());
  }
  std::sort(near.begin(), near.end());
  near.erase(std::unique(near.begin(), near.end()), near.end());
  leave(i);
  lists_.count[i] = 0;
  way_[i] = {};
  reach_[i] = static_cast<float>(kListed * sigma);
  for (const std::uint32_t j : near) {
    // From where the other was when its own list was found: so its skin is spent once only.
    const double distance = (points.position(i) - (points.position(j) - vec(way_[j]))).norm();
    if (j == i || distance >= static_cast<double>(std::max(reach_[i], reach_[j]))) continue;
    append(i, j);
    append(j, i);
  }
}

void LastingNeighbours::born(std::size_t parent) {
  if (!found_) return;
  const auto child = static_cast<std::uint32_t>(lists_.size());
  lists_.first.push_back(lists_.first[parent]);
  lists_.count.push_back(lists_.count[parent]);
  way_.push_back(way_[parent]);
  reach_.push_back(reach_[parent]);
  grow(child, of(child).size() + 1);
  append(child, static_cast<std::uint32_t>(parent));
  for (std::size_t k = 0; k < of(child).size(); ++k) append(of(child)[k], child);
}

void LastingNeighbours::died(std::size_t i) {
  if (!found_) return;
  leave(i);
  const std::size_t last = lists_.size() - 1;
  if (i != last) {
    for (const std::uint32_t j : of(last))
      std::ranges::replace(list(j), static_cast<std::uint32_t>(last), static_cast<std::uint32_t>(i));
    lists_.first[i] = lists_.first[last];
    lists_.count[i] = lists_.count[last];
    way_[i] = way_[last];
    reach_[i] = reach_[last];
  }
  lists_.first.pop_back();
  lists_.count.pop_back();
  way_.pop_back();
  reach_.pop_back();
}

/// Takes particle i out of the lists of others: the end of each takes its place.
void LastingNeighbours::leave(std::size_t i) {
  for (const std::uint32_t j : of(i)) {
    *std::ranges::find(list(j), static_cast<std::uint32_t>(i)) = of(j).back();
    --lists_.count[j];
  }
}

void LastingNeighbours::append(std::size_t i, std::uint32_t j) {
  const bool full = lists_.first[i] < lists_.index.size() || lists_.count[i] % kRoom == 0;
  if (full) grow(i, lists_.count[i] + 1);
  ++lists_.count[i];
  list(i).back() = j;
}

/// Copies the list of i behind all others, with room for at least so many.
void LastingNeighbours::grow(std::size_t i, std::size_t room) {
  const std::size_t to = grown_.size();
  grown_.resize(to + (room + kRoom - 1) / kRoom * kRoom);
  std::ranges::copy(of(i), grown_.begin() + static_cast<std::ptrdiff_t>(to));
  lists_.first[i] = lists_.index.size() + to;
}

std::size_t LastingNeighbours::bytes() const {
  return 8 * lists_.first.capacity() + 4 * (lists_.count.capacity() + lists_.index.capacity() + grown_.capacity()) +
         12 * way_.capacity() + 4 * reach_.capacity();
}

}  // namespace meniscus::sample
