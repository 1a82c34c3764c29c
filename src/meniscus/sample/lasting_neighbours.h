#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/sample/neighbour_grid.h>
#include <meniscus/sample/surface_points.h>

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace meniscus::sample {

/// Neighbour lists of repelling particles that outlast motion, births and deaths. Lists reach beyond the repulsion by a
/// skin: they are complete while what both ends of a pair have moved and grown since stays within it. A newborn counts as
/// one that stood where its parent did and has moved from there, so it inherits the parent's list, and completeness with it.
/// Same lists for any thread count. About 90 bytes a particle at rest.
class LastingNeighbours {
 public:
  /// Finds all lists anew, with reaches from the radii `sigma`.
  void find(const SurfacePoints& points, std::span<const double> sigma, const RunControl& run);
  /// Makes the lists good for particles that are at `points` with radii `sigma` now: those of the few that have torn their
  /// skin are looked for among the neighbours of their neighbours. Returns false if too many have, or went too far: find()
  /// is due. A hundredth of the particles may be a little beyond their skin; what they miss lies at the rim, where the
  /// repulsion is 0.1 % of its largest.
  bool mend(const SurfacePoints& points, std::span<const double> sigma, const RunControl& run);
  /// Forgets the lists: there are none until find().
  void clear() { found_ = false; }

  std::span<const std::uint32_t> of(std::size_t i) const {
    const std::size_t first = lists_.first[i];
    return {first < lists_.index.size() ? lists_.index.data() + first : grown_.data() + (first - lists_.index.size()),
            lists_.count[i]};
  }

  /// Particle i has moved on by `way`.
  void moved(std::size_t i, const Vec3& way) {
    if (!found_) return;
    for (std::size_t a = 0; a < 3; ++a) way_[i][a] += static_cast<float>(way[static_cast<int>(a)]);
  }
  /// A last particle was added where `parent` is.
  void born(std::size_t parent);
  /// Particle i was removed; the last one has taken its number.
  void died(std::size_t i);

  std::size_t bytes() const;

 private:
  struct Wear {
    std::size_t beyond = 0;
    bool too_far = false;
    std::vector<std::uint32_t> torn;
  };
  Wear wear(std::span<const double> sigma, const RunControl& run) const;
  void renew(std::uint32_t i, const SurfacePoints& points, double sigma);
  std::span<std::uint32_t> list(std::size_t i) {
    const auto l = of(i);
    return {const_cast<std::uint32_t*>(l.data()), l.size()};
  }
  void append(std::size_t i, std::uint32_t j);
  void leave(std::size_t i);
  void grow(std::size_t i, std::size_t room);

  bool found_ = false;
  Neighbours lists_;                       // as found; `first` beyond its end: in grown_
  std::vector<std::uint32_t> grown_;       // lists that have changed their length
  std::vector<std::array<float, 3>> way_;  // from where each was when its list was found
  std::vector<float> reach_;               // of its list
};

}  // namespace meniscus::sample
