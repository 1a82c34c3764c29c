#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/pointset/point_set_field.h>
#include <meniscus/pointset/value_change.h>

#include <cstdint>
#include <vector>

namespace meniscus::pointset {

/// Where a point of the surface is after a change of values.
struct Conformed {
  std::uint32_t index = 0;
  bool lost = false;  ///< no surface in reach any more
  Vec3 position = Vec3::Zero(), normal = Vec3::Zero();
};

/// Finds the changed surface from every point that the change touches, by Newton's method (4.3) on the changed values, whose
/// gradient is taken by differences. The change should move the surface by no more than half a reach. A point is lost when
/// it does not arrive, gets nine tenths of its reach away from where it began, or the slope vanishes: two sheets have met.
/// Points in rising order; the set itself is not changed. Deterministic for any number of threads.
std::vector<Conformed> conform(const PointSetField& field, const ValueChange& change, const RunControl& run = {});

}  // namespace meniscus::pointset
