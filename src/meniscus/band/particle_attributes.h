#pragma once

#include <meniscus/band/particle_motion.h>
#include <meniscus/base/attributes.h>
#include <meniscus/base/run_control.h>

#include <span>
#include <string>
#include <vector>

namespace meniscus::band {

/// Attributes of a cloud's particles at other points, by weights (1 - d²/reach²)³: floating-point ones as means, integers of
/// the heaviest neighbour, zero where no particle is within `reach` (world units). Names in `leave_out` are skipped.
Attributes carried_attributes(const Attributes& attributes, const ParticleFrame& particles, double reach,
                              std::span<const Vec3> at, const std::vector<std::string>& leave_out,
                              const RunControl& run = {});

}  // namespace meniscus::band
