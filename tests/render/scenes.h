#pragma once

#include <meniscus/render/render.h>

#include <cmath>
#include <numbers>

namespace meniscus::render {

/// A sphere of that radius with `n` rows of triangles, outward.
inline mesh::Mesh sphere_mesh(double radius, int n, const Vec3& center = Vec3::Zero()) {
  mesh::Mesh mesh;
  const int around = 2 * n;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j < around; ++j) {
      const double t = std::numbers::pi * i / n;
      const double p = std::numbers::pi * j / n;
      const Vec3 unit(std::sin(t) * std::cos(p), std::cos(t), -std::sin(t) * std::sin(p));
      mesh.positions.push_back(center + radius * unit);
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < around; ++j) {
      const int a = i * around + j;
      const int b = i * around + (j + 1) % around;
      mesh.triangles.push_back({a, a + around, b + around});
      mesh.triangles.push_back({a, b + around, b});
    }
  }
  return mesh;
}

/// A square of half-width `half` in the plane z, facing +z, of one colour.
inline MeshItem square(double half, double z, const Vec3& color, const Vec3& center = Vec3::Zero()) {
  MeshItem item;
  for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
    item.mesh.positions.push_back(center + Vec3(x * half, y * half, z));
  }
  item.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  item.material.color = color;
  return item;
}

/// Looks from (0, 0, distance) at the origin.
inline Camera from_front(double distance, double fov = 30) {
  Camera camera;
  camera.position = Vec3(0, 0, distance);
  camera.fov = fov;
  return camera;
}

inline RenderOptions flat(int width, int height, int samples) {
  RenderOptions options;
  options.width = width;
  options.height = height;
  options.samples = samples;
  options.shading = Shading::Flat;
  options.transparent = true;
  return options;
}

inline double total_alpha(const Image& image) {
  double sum = 0;
  for (const Pixel& p : image.pixels()) sum += static_cast<double>(p.a);
  return sum;
}

inline RunControl with_threads(int n) { return RunControl({.threads = n, .seed = 0, .on_progress = {}}); }

}  // namespace meniscus::render
