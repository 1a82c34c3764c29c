#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/run_control.h>
#include <meniscus/field/field.h>
#include <meniscus/sample/closing.h>

#include <cstddef>
#include <cstdint>
#include <optional>

namespace meniscus::sample {

struct MendOptions {
  double packing = 0.88;                  ///< pairs nearer than this share of the local spacing are faults
  double cover = 1.22;                    ///< empty circles above this, in those of the hexagonal lattice, are faults
  std::uint32_t attempts = 16;            ///< at each fault; every second one may add or take away a particle
  std::optional<std::size_t> count = {};  ///< bring the population to this number, where a particle more or less does least
  std::size_t max_count = 0;              ///< never more particles than this
  /// Nothing is done if more than 1 % of the particles stand beside an empty circle of 1.3, or any where the surface bends
  /// within the spacing: filling them and relaxing all then does better than mending place by place.
  bool leaves_vacancies = false;
};

struct Mended {
  bool done = true;        ///< false: vacancies were left
  std::size_t faults = 0;  ///< that remain
};

/// Repairs the few places that a relaxation leaves wrong. Every patch of a few spacings around a fault is shaken, or gets a
/// particle in its hole or loses one of its closest pair, is relaxed and packed anew while the rest stands still, and the
/// outcome is kept where the worst fault of the patch has become less. Then particles are added or taken away, patch by
/// patch, until `count` is met.
/// All points lie on the surface to 1e-6 of a spacing. Deterministic (shaking
/// keyed by the control's seed). Cost: one measure of all cells, then in proportion to the faults.
Mended mend(const field::Field& surface, const Box& box, const MendOptions& options, Population& population,
            const RunControl& run = {});

}  // namespace meniscus::sample
