#pragma once

#include <meniscus/base/vec.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace meniscus::sample {

/// Points that arrive one by one, to be asked who is near: cells of fixed size in an open hash, a chain of points in each.
class PointHash {
 public:
  PointHash(const Vec3& origin, double cell) : origin_(origin), inverse_(1 / cell), slots_(1024) {}

  /// Points are numbered in the order of insertion.
  void insert(const Vec3& p) {
    if (2 * (used_ + 1) > slots_.size()) grow();
    Slot& slot = find(key(cell(p)));
    if (slot.head == kNone) ++used_;
    slot.key = key(cell(p));
    next_.push_back(slot.head);
    slot.head = static_cast<std::uint32_t>(next_.size() - 1);
  }

  /// Calls visit(j) for the points in all cells that the ball meets, until it returns true; returns whether one did.
  template <class Visit>
  bool any_near(const Vec3& p, double radius, const Visit& visit) const {
    const Eigen::Vector3i lo = cell(p - Vec3::Constant(radius)), hi = cell(p + Vec3::Constant(radius));
    for (int z = lo.z(); z <= hi.z(); ++z)
      for (int y = lo.y(); y <= hi.y(); ++y)
        for (int x = lo.x(); x <= hi.x(); ++x)
          for (std::uint32_t j = find(key({x, y, z})).head; j != kNone; j = next_[j])
            if (visit(j)) return true;
    return false;
  }

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  struct Slot {
    std::uint64_t key = 0;
    std::uint32_t head = kNone;
  };

  Eigen::Vector3i cell(const Vec3& p) const {
    const Vec3 c = ((p - origin_) * inverse_).array().floor();
    return c.cast<int>();
  }
  static std::uint64_t key(const Eigen::Vector3i& c) {
    constexpr std::uint64_t mask = (1 << 21) - 1;
    return (static_cast<std::uint64_t>(c.x()) & mask) | (static_cast<std::uint64_t>(c.y()) & mask) << 21 |
           (static_cast<std::uint64_t>(c.z()) & mask) << 42;
  }
  const Slot& find(std::uint64_t k) const {
    const std::uint64_t mask = slots_.size() - 1;
    std::uint64_t s = (k * 0x9e3779b97f4a7c15ULL >> 24) & mask;
    while (slots_[s].head != kNone && slots_[s].key != k) s = (s + 1) & mask;
    return slots_[s];
  }
  Slot& find(std::uint64_t k) { return const_cast<Slot&>(static_cast<const PointHash*>(this)->find(k)); }
  void grow() {
    std::vector<Slot> old(2 * slots_.size());
    old.swap(slots_);
    for (const Slot& s : old)
      if (s.head != kNone) find(s.key) = s;
  }

  Vec3 origin_;
  double inverse_;
  std::vector<Slot> slots_;
  std::vector<std::uint32_t> next_;
  std::size_t used_ = 0;
};

}  // namespace meniscus::sample
