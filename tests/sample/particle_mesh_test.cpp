#include <meniscus/base/error.h>
#include <meniscus/sample/particle_mesh.h>
#include <meniscus/sample/spread.h>

#include "surfaces.h"

#include <gtest/gtest.h>

#include <numbers>
#include <set>

namespace meniscus::sample {
namespace {

struct Meshed {
  Sampling sampling;
  mesh::Mesh mesh;
  ParticleMeshReport report;
  Meshed(const field::Field& surface, const Box& box, const SpreadOptions& options)
      : sampling(spread(surface, box, options)) {
    mesh = particle_mesh(sampling.cloud, box, &report);
  }
  long euler() const { return static_cast<long>(mesh.positions.size()) - static_cast<long>(mesh.triangles.size()) / 2; }
  /// Every directed edge once and its opposite once.
  void expect_closed_manifold(long characteristic) const {
    EXPECT_TRUE(report.closed());
    EXPECT_EQ(report.unused, 0u);
    std::set<std::pair<int, int>> edges;
    for (const Triangle& t : mesh.triangles)
      for (std::size_t k = 0; k < 3; ++k) EXPECT_TRUE(edges.insert({t[k], t[(k + 1) % 3]}).second);
    for (const auto& [a, b] : edges) EXPECT_TRUE(edges.count({b, a}));
    EXPECT_EQ(euler(), characteristic);
  }
};

TEST(ParticleMesh, OfClosedSurfacesIsClosedAndManifold) {
  const Box box = Box::around(Vec3::Zero(), 1.6);
  for (const std::size_t n : {100u, 1000u, 5000u}) {
    const Meshed sphere(*test::sphere(), box, {.count = n});
    sphere.expect_closed_manifold(2);
    EXPECT_NEAR(mesh::volume(sphere.mesh), 4 * std::numbers::pi / 3, 25.0 / static_cast<double>(n)) << "orientation";
  }
  for (const double spacing : {0.15, 0.08}) {
    Meshed(*test::torus(1, 0.4), box, {.spacing = spacing}).expect_closed_manifold(0);
    Meshed(*test::three_blobs(), box, {.spacing = spacing}).expect_closed_manifold(2);
  }
}

TEST(ParticleMesh, WorksAtAnyScale) {
  for (const double scale : {0.01, 1000.0})
    Meshed(*test::three_blobs(scale), Box::around(Vec3::Zero(), 1.6 * scale), {.spacing = 0.1 * scale})
        .expect_closed_manifold(2);
}

TEST(ParticleMesh, APatchEndsAtTheBoxOnly) {
  const Meshed gyroid(*test::gyroid(), Box::around(Vec3::Zero(), 1), {.spacing = 0.1});
  EXPECT_GT(gyroid.report.border_edges, 0u);
  EXPECT_EQ(gyroid.report.open_edges, 0u);
}

TEST(ParticleMesh, TooCoarseASamplingIsReported) {
  const Meshed coarse(*test::torus(1, 0.1), Box::around(Vec3::Zero(), 1.6), {.spacing = 0.6});
  EXPECT_TRUE(coarse.report.open_edges > 0 || coarse.report.unused > 0 || coarse.report.closed());
  for (const Triangle& t : coarse.mesh.triangles) EXPECT_NE(t[0], t[1]);
}

TEST(ParticleMesh, NeedsNormalsAndRadii) {
  points::Cloud cloud;
  cloud.positions.push_back(Vec3::Zero());
  EXPECT_THROW(particle_mesh(cloud, Box::everywhere()), InvalidInput);
  EXPECT_TRUE(particle_mesh({}, Box::everywhere()).triangles.empty());
}

}  // namespace
}  // namespace meniscus::sample
