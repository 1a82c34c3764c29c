#include <meniscus/pointset/delta.h>

#include <algorithm>
#include <bit>
#include <numeric>
#include <variant>

namespace meniscus::pointset {
namespace {

bool same(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }

bool same(const Vec3& a, const Vec3& b) { return same(a.x(), b.x()) && same(a.y(), b.y()) && same(a.z(), b.z()); }

bool same(const PointSet& a, std::size_t i, const PointSet& b, std::size_t j) {
  const auto p = a.coefficients_of(i), q = b.coefficients_of(j);
  return same(a.position(i), b.position(j)) && same(a.normal(i), b.normal(j)) && same(a.border(i), b.border(j)) &&
         same(a.reach[i], b.reach[j]) &&
         std::equal(p.begin(), p.end(), q.begin(), q.end(), [](double x, double y) { return same(x, y); });
}

/// Both, one after the other; they have the same names.
Attributes joined(const Attributes& first, const Attributes& second) {
  Attributes all = first;
  for (const Attribute& a : second) {
    if (a.is_integer()) {
      const auto head = first.integers(a.name, a.components);
      std::vector<std::int64_t> values(head.begin(), head.end());
      const auto& tail = std::get<std::vector<std::int64_t>>(a.data);
      values.insert(values.end(), tail.begin(), tail.end());
      all.set_integers(a.name, a.components, std::move(values));
    } else {
      const auto head = first.values(a.name, a.components);
      std::vector<double> values(head.begin(), head.end());
      const auto& tail = std::get<std::vector<double>>(a.data);
      values.insert(values.end(), tail.begin(), tail.end());
      all.set(a.name, a.components, std::move(values));
    }
  }
  return all;
}

}  // namespace

Delta::Points Delta::taken(const PointSet& set, std::span<const std::size_t> indices) {
  Points points;
  for (const std::size_t i : indices) points.records.push_back(set.record(i));
  points.attributes = set.attributes.gathered(indices);
  return points;
}

void Delta::append(PointSet& set, const Points& points) {
  const std::size_t first = set.size();
  set.resize(first + points.records.size());
  for (std::size_t k = 0; k < points.records.size(); ++k) set.restore(first + k, points.records[k]);
  set.attributes = joined(set.attributes, points.attributes);
}

Delta::Delta(const PointSet& before, const PointSet& after, std::span<const std::uint32_t> origin) {
  std::size_t next = 0;
  for (std::size_t j = 0; j < origin.size(); ++j, ++next) {
    for (; next < origin[j]; ++next) removed_.push_back(next);
    if (same(before, next, after, j)) continue;
    changed_.push_back(next);
    was_.push_back(before.record(next));
    is_.push_back(after.record(j));
  }
  for (; next < before.size(); ++next) removed_.push_back(next);
  gone_ = taken(before, removed_);
  std::vector<std::size_t> fresh(after.size() - origin.size());
  std::iota(fresh.begin(), fresh.end(), origin.size());
  added_ = taken(after, fresh);
}

void Delta::redo(PointSet& set) const {
  for (std::size_t k = 0; k < changed_.size(); ++k) set.restore(changed_[k], is_[k]);
  if (!removed_.empty()) {
    std::vector<std::size_t> kept;
    std::size_t next = 0;
    for (std::size_t i = 0; i < set.size(); ++i) {
      if (next < removed_.size() && removed_[next] == i)
        ++next;
      else
        kept.push_back(i);
    }
    set.keep(kept);
  }
  append(set, added_);
}

void Delta::undo(PointSet& set) const {
  // Kept points, those that are gone behind them; then each at its old number.
  std::vector<std::size_t> order(set.size() - added_.records.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (added() > 0) set.keep(order);
  if (!removed_.empty()) {
    const std::size_t kept = set.size();
    append(set, gone_);
    order.clear();
    std::size_t next = 0, from = 0;
    for (std::size_t i = 0; i < set.size(); ++i) {
      if (next < removed_.size() && removed_[next] == i)
        order.push_back(kept + next++);
      else
        order.push_back(from++);
    }
    set.keep(order);
  }
  for (std::size_t k = 0; k < changed_.size(); ++k) set.restore(changed_[k], was_[k]);
}

}  // namespace meniscus::pointset
