#pragma once

#include <meniscus/base/random.h>
#include <meniscus/points/cloud.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

/// Clouds of known surfaces, with exact normals.
namespace meniscus::pointset::test {

inline double degrees_between(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

inline std::vector<Vec3> normals_of(const points::Cloud& cloud) {
  const auto n = cloud.attributes.values(attribute::kNormal, 3);
  std::vector<Vec3> normals;
  for (std::size_t i = 0; i + 2 < n.size(); i += 3) normals.emplace_back(n[i], n[i + 1], n[i + 2]);
  return normals;
}

inline points::Cloud cloud_of(const std::vector<Vec3>& positions, const std::vector<Vec3>& normals) {
  points::Cloud cloud;
  cloud.positions = positions;
  std::vector<double> values;
  for (const Vec3& n : normals) values.insert(values.end(), {n.x(), n.y(), n.z()});
  cloud.attributes.set(attribute::kNormal, 3, std::move(values));
  return cloud;
}

/// A Fibonacci spiral.
inline points::Cloud sphere(std::size_t count, double radius = 1, const Vec3& center = Vec3::Zero()) {
  std::vector<Vec3> positions, normals;
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 1 - (2.0 * static_cast<double>(i) + 1) / static_cast<double>(count);
    const double r = std::sqrt(1 - z * z), a = golden * static_cast<double>(i);
    normals.emplace_back(r * std::cos(a), r * std::sin(a), z);
    positions.push_back(center + radius * normals.back());
  }
  return cloud_of(positions, normals);
}

/// Outward normal of the torus about the z axis at (or near) p.
inline Vec3 torus_normal(const Vec3& p, double major) {
  const Vec3 ring = Vec3(p.x(), p.y(), 0).normalized() * major;
  return (p - ring).normalized();
}

/// Random, as dense everywhere, no two nearer than a third of the mean distance.
inline points::Cloud torus(std::size_t count, double major, double minor) {
  std::vector<Vec3> positions, normals;
  const double area = 4 * std::numbers::pi * std::numbers::pi * major * minor;
  const double apart = 0.6 * std::sqrt(area / static_cast<double>(count));
  for (std::uint64_t k = 0; positions.size() < count; ++k) {
    const auto u = random_uniform(1, k, 0);
    const double a = 2 * std::numbers::pi * u[0], b = 2 * std::numbers::pi * u[1];
    if (u[2] * (major + minor) > major + minor * std::cos(b)) continue;
    const Vec3 out(std::cos(a), std::sin(a), 0), n = std::cos(b) * out + std::sin(b) * Vec3::UnitZ();
    const Vec3 p = major * out + minor * n;
    if (std::any_of(positions.begin(), positions.end(),
                    [&](const Vec3& q) { return (p - q).squaredNorm() < apart * apart; }))
      continue;
    positions.push_back(p);
    normals.push_back(n);
  }
  return cloud_of(positions, normals);
}

/// A square plate of that width in the xy plane, jittered lattice points on both sides and along the rim.
inline points::Cloud plate(double width, double thickness, double spacing) {
  std::vector<Vec3> positions, normals;
  const int n = static_cast<int>(std::lround(width / spacing));
  const int rows = std::max(1, static_cast<int>(std::lround(thickness / spacing)) - 1);
  const auto jitter = [&](std::uint64_t id) -> Vec3 {
    const auto u = random_uniform(5, id, positions.size());
    return 0.3 * spacing * (2 * Vec3(u[0], u[1], u[2]) - Vec3::Ones());
  };
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j)
      for (const double side : {-1.0, 1.0}) {
        Vec3 p = Vec3(i * spacing - width / 2, j * spacing - width / 2, side * thickness / 2);
        if (i > 0 && j > 0 && i < n && j < n) p.head<2>() += jitter(1).head<2>();
        positions.push_back(p);
        normals.push_back(side * Vec3::UnitZ());
      }
  for (int i = 0; i <= n; ++i)
    for (int k = 1; k <= rows; ++k)
      for (int side = 0; side < 4; ++side) {
        const double s = side % 2 ? 1 : -1, along = i * spacing - width / 2, z = thickness * (k / (rows + 1.0) - 0.5);
        positions.push_back(side < 2 ? Vec3(s * width / 2, along, z) : Vec3(along, s * width / 2, z));
        normals.push_back(side < 2 ? Vec3(s, 0, 0) : Vec3(0, s, 0));
      }
  return cloud_of(positions, normals);
}

}  // namespace meniscus::pointset::test
