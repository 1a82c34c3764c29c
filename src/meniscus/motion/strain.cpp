#include <meniscus/base/parallel.h>
#include <meniscus/motion/strain.h>
#include <meniscus/motion/velocity.h>

#include <Eigen/Geometry>

#include <cmath>

namespace meniscus::motion {
namespace {

constexpr double kCrease = 0.5;    // cosine between normals of a triangle's corners, from where on there is a crease in it
constexpr double kNeedle = 1e-12;  // of its sides' squares: a triangle with less area has no plane

using Corners = std::array<std::size_t, 3>;

Corners corners(const Triangle& t) {
  return {static_cast<std::size_t>(t[0]), static_cast<std::size_t>(t[1]), static_cast<std::size_t>(t[2])};
}

bool creased(std::span<const Vec3> normals, const Corners& i) {
  return normals[i[0]].dot(normals[i[1]]) < kCrease || normals[i[1]].dot(normals[i[2]]) < kCrease ||
         normals[i[2]].dot(normals[i[0]]) < kCrease;
}

}  // namespace

Resisting resisting(std::span<const Vec3> positions, std::span<const Vec3> normals, std::span<const Triangle> triangles) {
  Resisting result;
  result.triangles.reserve(triangles.size());
  result.area.reserve(triangles.size());
  for (const Triangle& t : triangles) {
    const Corners i = corners(t);
    if (creased(normals, i)) continue;
    const Vec3 e = positions[i[1]] - positions[i[0]];
    const Vec3 d = positions[i[2]] - positions[i[0]];
    const double doubled = e.cross(d).norm();
    if (!(doubled > kNeedle * (e.squaredNorm() + d.squaredNorm()))) continue;
    result.triangles.push_back(t);
    result.area.push_back(doubled / 2);
  }
  return result;
}

TangentFrames tangent_frames(std::span<const Vec3> positions, std::span<const Vec3> normals,
                             std::span<const std::int32_t> towards) {
  TangentFrames f{std::vector<Vec3>(positions.size()), std::vector<Vec3>(positions.size())};
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const Vec3& n = normals[i];
    const Vec3 edge = positions[static_cast<std::size_t>(towards[i])] - positions[i];
    const Vec3 flat = edge - n.dot(edge) * n;
    if (flat.squaredNorm() > 1e-6 * edge.squaredNorm()) {
      f.first[i] = flat.normalized();
      f.second[i] = n.cross(f.first[i]);
    } else {
      tangents(n, f.first[i], f.second[i]);
    }
  }
  return f;
}

std::vector<Strain> strains(const Resisting& mesh, std::span<const Vec3> positions, std::span<const Vec3> normals,
                            std::span<const double> speeds, const TangentFrames& frames, const RunControl& run) {
  std::vector<Strain> list(mesh.triangles.size());
  parallel_for(list.size(), 256, run, [&](std::size_t f) {
    Strain& s = list[f];
    const Corners index = corners(mesh.triangles[f]);
    s.constant.setZero();
    s.weight = mesh.area[f];
    const Vec3 e = positions[index[1]] - positions[index[0]];
    const Vec3 d = positions[index[2]] - positions[index[0]];
    const Vec3 u = e.normalized();
    const Vec3 w = (d - u.dot(d) * u).normalized();
    const Vec2 p[3] = {{0, 0}, {e.norm(), 0}, {u.dot(d), w.dot(d)}};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2 opposite = p[(k + 2) % 3] - p[(k + 1) % 3];
      const Vec2 slope = Vec2(-opposite.y(), opposite.x()) / (2 * s.weight);  // of the function that is 1 at this corner
      const auto strain = [&](const Vec3& velocity) {
        const double a = u.dot(velocity);
        const double b = w.dot(velocity);
        return Vec3(a * slope.x(), b * slope.y(), (a * slope.y() + b * slope.x()) / std::sqrt(2.0));
      };
      const std::size_t i = index[k];
      s.corner[k] = static_cast<Eigen::Index>(i);
      s.rows.col(2 * static_cast<Eigen::Index>(k)) = strain(frames.first[i]);
      s.rows.col(2 * static_cast<Eigen::Index>(k) + 1) = strain(frames.second[i]);
      if (!speeds.empty()) s.constant += strain(speeds[i] * normals[i]);
    }
  });
  return list;
}

}  // namespace meniscus::motion
