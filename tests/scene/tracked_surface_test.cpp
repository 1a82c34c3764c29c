#include "support/program.h"

#include <meniscus/base/error.h>
#include <meniscus/mesh/validate.h>
#include <meniscus/scene/tracked_surface.h>

#include <gtest/gtest.h>

#include <fstream>

namespace meniscus::scene {
namespace {

using test::Scratch;

SurfaceSource scene_of(const Scratch& scratch, const std::string& surface) {
  const std::string path = scratch / "scene.json";
  std::ofstream(path) << R"({"format":"meniscus.scene","version":1,"fps":24,"range":[1,24],"surface":)" << surface << "}";
  return SurfaceSource({path}, {});
}

const std::string kMovingTorus =
    R"({"type":"torus","center":[{"expr":"t"},{"expr":"-2*t"},0],"axis":[0,1,0],"major":1,"minor":0.3})";

/// A mesh of the first surface with an attribute that is its place along x, and a number of its own.
io::Geometry painted(const SurfaceSource& source) {
  TrackedSurface first(source, {.voxel = 0.1});
  first.go_to(1);
  io::Geometry g{io::Geometry::Kind::Mesh, {}, first.mesh()};
  std::vector<double> heat;
  std::vector<std::int64_t> part;
  for (const Vec3& p : g.mesh.positions) {
    heat.push_back(p.x());
    part.push_back(p.x() > 0 ? 7 : 3);
  }
  g.mesh.attributes.set("heat", 1, heat);
  g.mesh.attributes.set_integers("part", 1, part);
  return g;
}

TEST(TrackedSurface, CarriesTheAttributesOfTheMeshItIsGiven) {
  const Scratch scratch;
  const SurfaceSource source = scene_of(scratch, kMovingTorus);
  const io::Geometry start = painted(source);
  for (const bool points : {false, true}) {
    TrackedSurface surface(source, {.points = points, .voxel = 0.1, .redistribution = 0, .start = start});
    for (long f = 1; f <= 5; ++f) surface.go_to(f);
    const std::vector<Vec3>& x = points ? surface.cloud().positions : surface.mesh().positions;
    const Attributes& a = points ? surface.cloud().attributes : surface.mesh().attributes;
    ASSERT_EQ(x.size(), start.mesh.positions.size());
    const auto heat = a.values("heat", 1);
    const auto part = a.integers("part");
    const auto id = a.integers("id");
    for (std::size_t i = 0; i < x.size(); ++i) {
      EXPECT_LT((x[i] - start.mesh.positions[i] - 4.0 / 24 * Vec3(1, -2, 0)).norm(), 1e-9);
      EXPECT_EQ(heat[i], start.mesh.positions[i].x());
      EXPECT_EQ(part[i], heat[i] > 0 ? 7 : 3);
      EXPECT_EQ(id[i], start.mesh.attributes.integers("id")[i]);
    }
  }
}

TEST(TrackedSurface, NewVerticesTakeAttributesFromTheirNearestPlaceAndIdsThatWereNeverUsed) {
  const SurfaceSource source({MENISCUS_SOURCE_DIR "/scenes/two_blobs.json"}, {});
  io::Geometry start = painted(source);
  const auto ids = static_cast<std::int64_t>(start.mesh.positions.size());
  TrackedSurface surface(source, {.voxel = 0.1, .start = std::move(start)});
  bool mended = false;
  for (long f = 1; f <= 12; ++f) {
    const TrackStep step = surface.go_to(f);
    mended = mended || step.change.reason == "topology";
    EXPECT_TRUE(mesh::validate(surface.mesh()).good());
  }
  ASSERT_TRUE(mended);
  const auto id = surface.mesh().attributes.integers("id");
  const auto heat = surface.mesh().attributes.values("heat", 1);
  std::size_t fresh = 0;
  for (std::size_t i = 0; i < id.size(); ++i) {
    if (id[i] < ids) continue;
    ++fresh;
    EXPECT_LT(std::abs(heat[i]), 0.6) << "the neck is where the blobs were nearest";
  }
  EXPECT_GT(fresh, 0u);
}

TEST(TrackedSurface, RefusesAStartThatIsNotTheSurface) {
  const Scratch scratch;
  const SurfaceSource source = scene_of(scratch, kMovingTorus);
  io::Geometry start = painted(source);
  for (Vec3& p : start.mesh.positions) p *= 3;
  const auto begin = [&](const io::Geometry& g, bool points) {
    TrackedSurface(source, {.points = points, .voxel = 0.1, .start = g}).go_to(1);
  };
  EXPECT_THROW(begin(start, false), InvalidInput);
  EXPECT_THROW(begin(start, true), InvalidInput);
  start = painted(source);
  start.mesh.triangles.pop_back();
  EXPECT_THROW(begin(start, false), InvalidInput);
  EXPECT_NO_THROW(begin(start, true));
  EXPECT_THROW(begin({io::Geometry::Kind::Cloud, {start.mesh.positions, {}}, {}}, false), InvalidInput);
}

TEST(TrackedSurface, KnowsVelocitiesBesideTheSurface) {
  const Scratch scratch;
  const SurfaceSource source = scene_of(scratch, kMovingTorus);
  for (const bool points : {false, true}) {
    TrackedSurface surface(source, {.points = points, .voxel = 0.1});
    surface.go_to(1);
    surface.go_to(2);
    const band::Band band = surface.band();
    std::vector<Vec3> at;
    for (std::size_t b = 0; b < band.brick_count(); ++b)
      for (int i = 0; i < 8; ++i) at.push_back(band.position(b, i, 7 - i, i));
    ASSERT_GT(at.size(), 100u);
    for (const Vec3& v : surface.velocities(at)) EXPECT_LT((v - Vec3(1, -2, 0)).norm(), 1e-9);
  }
}

TEST(TrackedSurface, MayVanishAndComeBack) {
  const Scratch scratch;
  const SurfaceSource source =
      scene_of(scratch, R"J({"type":"sphere","center":[0,0,0],"radius":{"expr":"0.5*cos(6.283185307*t)"}})J");
  for (const bool points : {false, true}) {
    for (const auto kind : {motion::Velocity::Blended, motion::Velocity::Total, motion::Velocity::Isometric}) {
      TrackedSurface surface(source, {.tracker = {.velocity = {.kind = kind}}, .points = points, .voxel = 0.06});
      const auto count = [&] { return points ? surface.cloud().size() : surface.mesh().positions.size(); };
      surface.go_to(1);
      EXPECT_GT(count(), 100u);
      for (long f = 2; f <= 12; ++f) surface.go_to(f);
      EXPECT_EQ(count(), 0u);
      EXPECT_TRUE(surface.velocities(std::vector<Vec3>{{1, 0, 0}})[0].isZero());
      for (long f = 13; f <= 24; ++f) surface.go_to(f);
      EXPECT_GT(count(), 50u);
      if (!points) EXPECT_TRUE(mesh::validate(surface.mesh()).good());
    }
  }
}

TEST(TrackedSurface, AnImmobileSurfaceKeepsEveryVertexWhereItIs) {
  const Scratch scratch;
  const SurfaceSource source =
      scene_of(scratch, R"({"type":"torus","center":[0,0,0],"axis":[0,1,0],"major":1,"minor":0.3})");
  for (const auto kind :
       {motion::Velocity::Normal, motion::Velocity::Blended, motion::Velocity::Total, motion::Velocity::Isometric}) {
    TrackedSurface surface(source, {.tracker = {.velocity = {.kind = kind}}, .voxel = 0.1});
    surface.go_to(1);
    const std::vector<Vec3> before = surface.mesh().positions;
    for (long f = 2; f <= 4; ++f) EXPECT_EQ(surface.go_to(f).change.reason, "");
    for (std::size_t i = 0; i < before.size(); ++i) EXPECT_LT((surface.mesh().positions[i] - before[i]).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace meniscus::scene
