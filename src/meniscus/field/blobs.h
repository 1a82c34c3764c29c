#pragma once

#include <meniscus/field/field.h>

#include <memory>
#include <span>
#include <vector>

namespace meniscus::field {

/// How a blob fades with u = d²/radius², d the distance to its point or segment.
enum class BlobKernel {
  Gaussian,  ///< exp(−u) [WH94 §5]; counts as 0 where it is below 1e-16
  Compact,   ///< (1−u)³ for u < 1, else 0 [SS11 §5]
};

/// One blob about a point.
struct Blob {
  Number3 center;
  Number radius;      ///< world units, > 0: width of the Gaussian, or support of the compact kernel
  Number weight = 1;  ///< negative weights carve
};

/// One blob about the segment a b.
struct SegmentBlob {
  Number3 a;
  Number3 b;
  Number radius;
  Number weight = 1;
};

/// F = bias − Σ wᵢ k(dᵢ²/radiusᵢ²). Costs what reaches the point, whatever the number of blobs. Outside every support F =
/// bias and ∇F = 0. Unknowns: bias, and per item "items[i].center.x" … "items[i].weight". Throws InvalidInput for a radius
/// that is not above zero, or numbers that are not finite.
std::unique_ptr<Field> blobs(BlobKernel kernel, const Number& bias, std::span<const Blob> items);
std::unique_ptr<Field> segments(BlobKernel kernel, const Number& bias, std::span<const SegmentBlob> items);

/// Particles as compact blobs of weight 1: F = (3/4)³ − Σ (1 − d²/(2rᵢ)²)³, so that a lone particle is a sphere of its
/// radius rᵢ. No unknowns. `radii` holds one number for all or one per particle (world units); `velocities` one vector per
/// particle (per second) or none: they give F_t and the material velocity. Particles that are not finite are left out;
/// `dropped` counts them. Throws InvalidInput for radii that are not above zero or counts that do not fit.
std::unique_ptr<Field> particles(std::span<const Vec3> positions, std::span<const double> radii,
                                 std::span<const Vec3> velocities = {}, std::size_t* dropped = nullptr);

}  // namespace meniscus::field
