#pragma once

#include <meniscus/polygonize/clipped_field.h>
#include <meniscus/polygonize/shell.h>

namespace meniscus::polygonize {

/// Samples a field. Points that bricks of one call share are evaluated once.
class FieldSampler : public Sampler {
 public:
  /// Both must outlive the sampler.
  FieldSampler(const ClippedField& field, const Lattice& lattice) : field_(field), lattice_(lattice) {}
  std::size_t sample(std::span<const Coord> bricks, double* values) const override;

 private:
  const ClippedField& field_;
  const Lattice& lattice_;
};

}  // namespace meniscus::polygonize
