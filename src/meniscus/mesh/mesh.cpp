#include <meniscus/mesh/mesh.h>

#include <Eigen/Geometry>

namespace meniscus::mesh {
namespace {

/// Twice the vector area of triangle t.
Vec3 cross_product(const Mesh& mesh, const Triangle& t) {
  const Vec3& a = mesh.positions[static_cast<std::size_t>(t[0])];
  const Vec3& b = mesh.positions[static_cast<std::size_t>(t[1])];
  const Vec3& c = mesh.positions[static_cast<std::size_t>(t[2])];
  return (b - a).cross(c - a);
}

}  // namespace

Box bounds(const Mesh& mesh) {
  Box box;
  for (const Vec3& p : mesh.positions) box.extend(p);
  return box;
}

double area(const Mesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) sum += cross_product(mesh, t).norm();
  return 0.5 * sum;
}

double volume(const Mesh& mesh) {
  if (mesh.positions.empty()) return 0;
  // Taken about the middle of the box: far from the origin the terms would cancel badly.
  const Vec3 origin = bounds(mesh).center();
  double sum = 0;
  for (const Triangle& t : mesh.triangles)
    sum += (mesh.positions[static_cast<std::size_t>(t[0])] - origin).dot(cross_product(mesh, t));
  return sum / 6;
}

std::vector<Vec3> vertex_normals(const Mesh& mesh) {
  std::vector<Vec3> normals(mesh.positions.size(), Vec3::Zero());
  for (const Triangle& t : mesh.triangles) {
    const Vec3 n = cross_product(mesh, t);
    for (const std::int32_t v : t) normals[static_cast<std::size_t>(v)] += n;
  }
  for (Vec3& n : normals) {
    const double length = n.norm();
    if (length > 0) n /= length;
  }
  return normals;
}

}  // namespace meniscus::mesh
