#pragma once

// Clouds of known surfaces, shared by the tests and benchmarks of point sets.
#include <meniscus/base/random.h>
#include <meniscus/points/cloud.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

namespace meniscus::pointset::shapes {

inline constexpr double kPi = std::numbers::pi;

/// Points with normals.
class Builder {
 public:
  void add(const Vec3& p, const Vec3& n) {
    cloud_.positions.push_back(p);
    normals_.insert(normals_.end(), n.data(), n.data() + 3);
  }
  points::Cloud take() {
    cloud_.attributes.set(attribute::kNormal, 3, std::move(normals_));
    return std::move(cloud_);
  }

 private:
  points::Cloud cloud_;
  std::vector<double> normals_;
};

/// Point i of a sequence that fills the unit square evenly (multiples of the plastic number's powers).
inline Vec2 even(std::size_t i) {
  const double g = 1.32471795724474602596, t = static_cast<double>(i) + 0.5;
  return {std::fmod(t / g, 1.0), std::fmod(t / (g * g), 1.0)};
}

/// Direction i of n spread evenly over the sphere, along a spiral.
inline Vec3 direction(std::size_t i, std::size_t n) {
  const double z = 1 - (2.0 * static_cast<double>(i) + 1) / static_cast<double>(n);
  const double angle = static_cast<double>(i) * kPi * (3 - std::sqrt(5.0)), r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

inline points::Cloud sphere(std::size_t n, double radius = 1, const Vec3& center = Vec3::Zero()) {
  Builder b;
  for (std::size_t i = 0; i < n; ++i) b.add(center + radius * direction(i, n), direction(i, n));
  return b.take();
}

/// About the z axis.
inline points::Cloud torus(std::size_t n, double major = 1, double minor = 0.4, const Vec3& center = Vec3::Zero()) {
  Builder b;
  for (std::size_t i = 0; i < n; ++i) {
    const Vec2 s = even(i);
    // The share of area up to angle v from the outer equator is (v + (minor/major) sin v) / 2π.
    double v = 2 * kPi * s.y();
    for (int k = 0; k < 20; ++k)
      v -= (v + minor / major * std::sin(v) - 2 * kPi * s.y()) / (1 + minor / major * std::cos(v));
    const double u = 2 * kPi * s.x();
    const Vec3 out(std::cos(u), std::sin(u), 0), n_(std::cos(v) * out + std::sin(v) * Vec3::UnitZ());
    b.add(center + major * out + minor * n_, n_);
  }
  return b.take();
}

/// A cube of half-width `half` inside, grown by `round` on all sides.
inline points::Cloud rounded_cube(std::size_t n, double half = 0.7, double round = 0.3) {
  const double faces = 24 * half * half, edges = 12 * half * kPi * round, corners = 4 * kPi * round * round;
  const double density = static_cast<double>(n) / (faces + edges + corners);
  Builder b;
  const auto count = [&](double area) { return static_cast<std::size_t>(std::lround(area * density)); };
  const std::size_t face = count(faces / 6), edge = count(edges / 12), corner = count(corners);
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0})
      for (std::size_t i = 0; i < face; ++i) {
        const Vec2 s = even(i);
        Vec3 p;
        p[axis] = side * (half + round);
        p[(axis + 1) % 3] = half * (2 * s.x() - 1);
        p[(axis + 2) % 3] = half * (2 * s.y() - 1);
        b.add(p, side * Vec3::Unit(axis));
      }
  for (int axis = 0; axis < 3; ++axis)
    for (int quarter = 0; quarter < 4; ++quarter)
      for (std::size_t i = 0; i < edge; ++i) {
        const Vec2 s = even(i);
        const double angle = 0.5 * kPi * (quarter + s.y());
        Vec3 normal = Vec3::Zero(), p;
        normal[(axis + 1) % 3] = std::cos(angle);
        normal[(axis + 2) % 3] = std::sin(angle);
        p = round * normal;
        p[axis] = half * (2 * s.x() - 1);
        p[(axis + 1) % 3] += quarter == 0 || quarter == 3 ? half : -half;
        p[(axis + 2) % 3] += quarter < 2 ? half : -half;
        b.add(p, normal);
      }
  for (std::size_t i = 0; i < corner; ++i) {
    const Vec3 d = direction(i, corner);
    b.add(round * d + half * d.cwiseSign(), d);
  }
  return b.take();
}

inline double sphere_distance(const Vec3& p) { return p.norm() - 1; }
inline double torus_distance(const Vec3& p) {
  const double ring = std::hypot(p.x(), p.y()) - 1;
  return std::hypot(ring, p.z()) - 0.4;
}
inline double rounded_cube_distance(const Vec3& p) {
  const Vec3 q = p.cwiseAbs() - Vec3::Constant(0.7);
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0) - 0.3;
}

/// The three shapes on which accuracy is measured; diameter is that of their bounding boxes.
struct Shape {
  std::string name;
  points::Cloud (*sample)(std::size_t);
  double (*distance)(const Vec3&);
  double diameter;
};
inline const std::vector<Shape>& all() {
  static const std::vector<Shape> kShapes = {
      {"sphere", [](std::size_t n) { return sphere(n); }, sphere_distance, 2 * std::sqrt(3.0)},
      {"torus", [](std::size_t n) { return torus(n); }, torus_distance, std::sqrt(2 * 2.8 * 2.8 + 0.8 * 0.8)},
      {"rounded cube", [](std::size_t n) { return rounded_cube(n); }, rounded_cube_distance, 2 * std::sqrt(3.0)}};
  return kShapes;
}

/// A flat square sheet of side 2 in the plane z = 0: an open border all around.
inline points::Cloud sheet(std::size_t n) {
  Builder b;
  for (std::size_t i = 0; i < n; ++i) b.add({2 * even(i).x() - 1, 2 * even(i).y() - 1, 0}, Vec3::UnitZ());
  return b.take();
}

inline points::Cloud transformed(points::Cloud cloud, double scale, const Vec3& shift = Vec3::Zero()) {
  for (Vec3& p : cloud.positions) p = scale * p + shift;
  return cloud;
}

/// Three numbers of a standard normal distribution.
inline Vec3 gaussian(std::uint64_t id, std::uint64_t seed = 3) {
  const auto u = random_uniform(seed, id, 0);
  const auto v = random_uniform(seed, id, 1);
  const auto one = [](double a, double b) { return std::sqrt(-2 * std::log(1 - a)) * std::cos(2 * kPi * b); };
  return {one(u[0], u[1]), one(u[2], u[3]), one(v[0], v[1])};
}

}  // namespace meniscus::pointset::shapes
