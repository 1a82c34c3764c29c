#pragma once

#include <meniscus/pointset/point_set.h>

#include <cstdint>
#include <span>
#include <vector>

namespace meniscus::pointset {

/// What differs between two states of a point set, no more: so that one can be turned into the other and back, to the bit.
/// Points are changed, removed, or added at the end; those that stay keep their order and attributes.
class Delta {
 public:
  Delta() = default;
  /// `origin[i]` is the number that point i of `after` had in `before`, rising; points beyond the end of `origin` are new.
  Delta(const PointSet& before, const PointSet& after, std::span<const std::uint32_t> origin);

  /// Turns the earlier state into the later.
  void redo(PointSet& set) const;
  /// Turns the later state into the earlier.
  void undo(PointSet& set) const;

  std::size_t changed() const { return changed_.size(); }
  std::size_t removed() const { return removed_.size(); }
  std::size_t added() const { return added_.records.size(); }
  /// Points that exist only before or only after, or differ.
  bool empty() const { return changed() + removed() + added() == 0; }

 private:
  struct Points {
    std::vector<PointRecord> records;
    Attributes attributes;
  };
  static Points taken(const PointSet& set, std::span<const std::size_t> indices);
  static void append(PointSet& set, const Points& points);

  std::vector<std::size_t> changed_;  // numbers before
  std::vector<PointRecord> was_, is_;
  std::vector<std::size_t> removed_;  // numbers before, rising
  Points gone_, added_;
};

}  // namespace meniscus::pointset
