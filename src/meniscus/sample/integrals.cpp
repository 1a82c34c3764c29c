#include <meniscus/base/error.h>
#include <meniscus/sample/integrals.h>
#include <meniscus/sample/spread.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace meniscus::sample {
namespace {

/// A hexagonal cell cut out of the exponential map is larger than the piece of surface by this share of K · area: from the
/// area of the regular geodesic hexagon, 2√3 b² (1 − 0.165 K b²).
constexpr double kHexagonExcess = 0.0476;
/// Mean of r² over a regular hexagon, in its area: 5 / (18 √3).
constexpr double kHexagonMoment = 5 / (18 * std::numbers::sqrt3);
constexpr double kDoubt = 0.25;  // share of a correction that is given as error

std::span<const double> needed(const points::Cloud& cloud, std::string_view name, std::size_t components) {
  const auto values = cloud.attributes.values(name, components);
  if (values.empty() && !cloud.empty()) throw InvalidInput("the sampling has no attribute '" + std::string(name) + "'");
  return values;
}

}  // namespace

SurfaceIntegrals integrate(const points::Cloud& cloud) {
  const auto area = needed(cloud, attribute::kArea, 1), mean = needed(cloud, attribute::kMeanCurvature, 1);
  const auto gauss = needed(cloud, attribute::kGaussCurvature, 1), normal = needed(cloud, meniscus::attribute::kNormal, 3);
  SurfaceIntegrals out;
  const Vec3 origin = cloud.empty() ? Vec3(Vec3::Zero()) : points::bounds(cloud).center();
  double area_correction = 0, volume_correction = 0, scatter = 0, distance = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const double lost = kHexagonExcess * gauss[i] * area[i] * area[i];
    const double a = area[i] - lost;
    const Vec3 n(normal[3 * i], normal[3 * i + 1], normal[3 * i + 2]), p = cloud.positions[i] - origin;
    // Over the paraboloid of the cell, m the mean of r²: ∫ x·n dA = (p·n) · plane area + H m a / 2, and the plane area is
    // less than a by the factor 1 − (κ₁² + κ₂²) m / 4.
    const double m = kHexagonMoment * a, squares = 4 * mean[i] * mean[i] - 2 * gauss[i];
    const double bend = (0.5 * mean[i] - 0.25 * squares * p.dot(n)) * m * a;
    out.area.value += a;
    out.volume.value += (a * p.dot(n) + bend) / 3;
    out.total_gauss.value += gauss[i] * a;
    area_correction += std::abs(lost);
    volume_correction += (std::abs(0.5 * mean[i]) + 0.25 * squares * std::abs(p.dot(n))) * m * a / 3;
    scatter += lost * lost;
    distance = std::max(distance, std::abs(p.dot(n)));
  }
  out.area.error = kDoubt * area_correction + std::sqrt(scatter);
  // Changes of curvature along the surface enter at the same order and are not corrected: take the whole of it.
  out.volume.error = volume_correction + out.area.error * distance / 3;
  out.total_gauss.error = out.area.value > 0 ? std::abs(out.total_gauss.value) * out.area.error / out.area.value : 0;
  return out;
}

}  // namespace meniscus::sample
