#include <meniscus/base/error.h>
#include <meniscus/io/geometry.h>
#include <meniscus/io/msurf.h>
#include <meniscus/scene/point_surface.h>

#include <cmath>

namespace meniscus::scene {
namespace {

bool has_all_normals(const points::Cloud& cloud) {
  const auto n = cloud.attributes.values(attribute::kNormal, 3);
  if (n.size() != 3 * cloud.size()) return false;
  for (std::size_t i = 0; i < n.size(); i += 3)
    if (!(std::hypot(n[i], n[i + 1], n[i + 2]) > 0)) return false;
  return true;
}

}  // namespace

bool is_point_surface(const points::Cloud& cloud) {
  return !cloud.attributes.values(attribute::kNormal, 3).empty() && !cloud.attributes.has(attribute::kRadius);
}

points::Cloud points_of(io::Geometry geometry) {
  if (geometry.kind == io::Geometry::Kind::Cloud) return std::move(geometry.cloud);
  mesh::Mesh& mesh = geometry.mesh;
  if (!mesh.triangles.empty() && !mesh.attributes.has(attribute::kNormal)) {
    std::vector<double> normals;
    for (const Vec3& n : mesh::vertex_normals(mesh)) normals.insert(normals.end(), n.data(), n.data() + 3);
    mesh.attributes.set(attribute::kNormal, 3, std::move(normals));
  }
  return {std::move(mesh.positions), std::move(mesh.attributes)};
}

pointset::Solid point_surface(points::Cloud cloud, const std::string& path, const pointset::FitOptions& options,
                              PointSurfaceReport* report, const RunControl& run) {
  PointSurfaceReport own;
  PointSurfaceReport& r = report != nullptr ? *report : own;
  try {
    r.estimated = !has_all_normals(cloud);
    if (r.estimated) cloud = pointset::with_normals(cloud, {}, &r.normals, run.part(0, 0.5));
    pointset::Solid solid;
    solid.set = pointset::fit(cloud, options, &r.fit, run.part(r.estimated ? 0.5 : 0, 1));
    return solid;
  } catch (const InvalidInput& e) {
    throw IoError(path, e.what());
  }
}

pointset::Solid read_point_surface(const std::string& path, const pointset::FitOptions& options, PointSurfaceReport* report,
                                   const RunControl& run) {
  if (io::format_of_input(path) == "msurf") return io::read_msurf(path);
  return point_surface(points_of(io::read_geometry(path)), path, options, report, run);
}

}  // namespace meniscus::scene
