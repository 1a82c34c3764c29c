#include <meniscus/render/framing.h>
#include <meniscus/render/subject.h>

#include <algorithm>
#include <cmath>

namespace meniscus::render {
namespace {

constexpr double kStrayReach = 0.75;

// Everything but strays: see subject_bounds.
Box box_without_strays(const std::vector<Vec3>& positions) {
  Box box;
  std::vector<double> values;
  for (int axis = 0; axis < 3; ++axis) {
    values.clear();
    for (const Vec3& p : positions) {
      if (p.allFinite()) values.push_back(p[axis]);
    }
    if (values.empty()) return {};
    const auto quantile = [&](double q) {
      const auto k = static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
      std::nth_element(values.begin(), values.begin() + k, values.end());
      return values[static_cast<std::size_t>(k)];
    };
    const double low = quantile(0.05);
    const double high = quantile(0.95);
    box.min[axis] = low - kStrayReach * (high - low);
    box.max[axis] = high + kStrayReach * (high - low);
  }
  return box;
}

// With fewer points there is no telling strays from subject.
constexpr std::size_t kEnoughForStrays = 100;

Box kept_region(const points::Cloud& cloud) {
  return cloud.size() < kEnoughForStrays ? Box::everywhere() : box_without_strays(cloud.positions);
}

double estimated_radius(const CloudItem& item) {
  const Box kept = kept_region(item.cloud);
  Box box;
  std::size_t count = 0;
  for (const Vec3& p : item.cloud.positions) {
    if (!p.allFinite() || !kept.contains(p)) continue;
    box.extend(p);
    ++count;
  }
  const double size = box.diameter();
  if (!(size > 0)) return 1;
  const auto n = static_cast<double>(count);
  if (!item.spheres && item.cloud.attributes.has(attribute::kNormal)) return 0.5 * size / std::sqrt(n);
  const Vec3 sides = box.size().cwiseMax(0.01 * size);  // a sheet of points still has a thickness
  return 0.5 * std::cbrt(sides.prod() / n);
}

}  // namespace

std::vector<double> radii_of(const CloudItem& item) {
  const auto scales = item.cloud.attributes.values(attribute::kRadius, 1);
  std::vector<double> radii(item.cloud.size());
  if (item.radius || scales.size() != radii.size()) {
    std::fill(radii.begin(), radii.end(), item.radius ? *item.radius : estimated_radius(item));
  } else {
    std::copy(scales.begin(), scales.end(), radii.begin());
  }
  for (double& r : radii) r *= item.radius_scale;
  return radii;
}

void visit_subject(const Scene& scene, FunctionRef<void(const Vec3&, double)> visit) {
  for (const MeshItem& item : scene.meshes) {
    for (const Vec3& p : item.mesh.positions) {
      if (p.allFinite()) visit(p, 0);
    }
  }
  for (const CloudItem& item : scene.clouds) {
    const Box kept = kept_region(item.cloud);
    const std::vector<double> radii = radii_of(item);
    for (std::size_t i = 0; i < item.cloud.size(); ++i) {
      const Vec3& p = item.cloud.positions[i];
      if (p.allFinite() && kept.contains(p) && radii[i] > 0 && std::isfinite(radii[i])) visit(p, radii[i]);
    }
  }
}

Box subject_bounds(const Scene& scene) {
  Box box;
  visit_subject(scene, [&](const Vec3& p, double r) { box.extend(Box::around(p, r)); });
  return box;
}

Camera frame(const Scene& scene, const View& view) {
  Framing framing(view);
  visit_subject(scene, [&](const Vec3& p, double r) { framing.add(p, r); });
  const auto camera = framing.camera();
  return camera ? *camera : frame(subject_bounds(scene), view);
}

}  // namespace meniscus::render
