#include <meniscus/scene/point_surface.h>

#include <meniscus/base/error.h>
#include <meniscus/field/field.h>
#include <meniscus/io/msurf.h>
#include <meniscus/scene/build_field.h>
#include <meniscus/scene/surface_source.h>

#include "pointset/shapes.h"
#include "support/scratch.h"

#include <gtest/gtest.h>

#include <fstream>

namespace meniscus::scene {
namespace {

namespace shapes = pointset::shapes;

/// A cloud written in four ways.
class PointSurface : public testing::Test {
 protected:
  std::string write(const std::string& name, const points::Cloud& cloud) {
    const std::string path = folder_ / name;
    io::WriteOptions o;
    o.overwrite = true;
    io::write_cloud(path, cloud, o);
    return path;
  }
  SurfaceSource::Kind kind(const std::string& path, SourceOptions options = {}) {
    return SurfaceSource({path}, std::move(options)).kind();
  }
  test::Scratch folder_;
};

TEST_F(PointSurface, NormalsWithoutARadiusMakeASurface) {
  points::Cloud cloud = shapes::sphere(800);
  const std::string with_normals = write("a.ply", cloud);
  EXPECT_EQ(kind(with_normals), SurfaceSource::Kind::Points);
  SourceOptions as_particles;
  as_particles.radius = 0.1;
  EXPECT_EQ(kind(with_normals, as_particles), SurfaceSource::Kind::Particles);
  cloud.attributes.set(attribute::kRadius, 1, std::vector<double>(cloud.size(), 0.1));
  EXPECT_EQ(kind(write("b.ply", cloud)), SurfaceSource::Kind::Particles);
  cloud.attributes.erase(attribute::kRadius);
  cloud.attributes.erase(attribute::kNormal);
  EXPECT_EQ(kind(write("c.ply", cloud)), SurfaceSource::Kind::Particles);

  const Surface s = SurfaceSource({with_normals}, {}).open({});
  EXPECT_TRUE(s.open);
  EXPECT_NEAR(field::value_at(*s.field, {1, 0, 0}), 0, 1e-3);
}

TEST_F(PointSurface, MissingNormalsAreEstimated) {
  points::Cloud cloud = shapes::sphere(800);
  cloud.attributes.erase(attribute::kNormal);
  PointSurfaceReport report;
  const auto field = pointset::field_of(point_surface(cloud, "a.ply", {}, &report));
  EXPECT_TRUE(report.estimated);
  EXPECT_EQ(report.normals.estimated, 800u);
  EXPECT_NEAR(field::value_at(*field, {0, 1.05, 0}), 0.05, 0.01);
  points::Cloud one;
  one.positions = {Vec3(1, 2, 3)};
  EXPECT_THROW(point_surface(one, "one.ply"), IoError);
}

TEST_F(PointSurface, MeshesGiveTheirVerticesAndNormals) {
  io::Geometry g;
  g.kind = io::Geometry::Kind::Mesh;
  g.mesh.positions = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)};
  g.mesh.triangles = {{0, 1, 2}};
  const points::Cloud c = points_of(g);
  const auto n = c.attributes.values(attribute::kNormal, 3);
  ASSERT_EQ(n.size(), 9u);
  EXPECT_NEAR(n[5], 1, 1e-12);
}

TEST_F(PointSurface, SceneLeafTakesCloudsAndMsurf) {
  write("a.ply", shapes::sphere(800));
  io::write_msurf(folder_ / "a.msurf", read_point_surface(folder_ / "a.ply"));
  for (const char* file : {"a.ply", "a.msurf"}) {
    const std::string text = R"({"format": "meniscus.scene", "version": 1, "surface": {"type": "offset", "distance": 0.05,)"
                             R"( "input": {"type": "points", "file": ")" +
                             std::string(file) + R"("}}})";
    const std::string path = folder_ / "scene.json";
    std::ofstream(path) << text;
    const SurfaceSource source({path}, {});
    const Surface s = source.open({});
    EXPECT_TRUE(s.open);
    EXPECT_NEAR(field::value_at(*s.field, {1.05, 0, 0}), 0, 2e-3) << file;
  }
}

}  // namespace
}  // namespace meniscus::scene
