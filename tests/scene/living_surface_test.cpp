#include "support/program.h"

#include <meniscus/base/error.h>
#include <meniscus/field/primitives.h>
#include <meniscus/io/geometry.h>
#include <meniscus/io/vdb.h>
#include <meniscus/scene/morph_job.h>
#include <meniscus/scene/skin_job.h>

#include <gtest/gtest.h>

#include <filesystem>

namespace meniscus::scene {
namespace {

using test::contents;
using test::Scratch;

MorphJobOptions ball_to_ring(const std::string& output) {
  MorphJobOptions o;
  o.morph.voxel = 0.12;
  o.morph.frames = 6;
  o.output.meshes = output;
  o.shapes = "ball to ring";
  return o;
}

void run(const MorphJobOptions& options, int stop_after = 100) {
  const auto ball = field::sphere({0, 0, 0}, 1), ring = field::torus({0, 0, 0}, {0, 1, 0}, 1, 0.35);
  run_morph_job(*ball, *ring, options, [&](const MorphJobFrame& f) {
    if (f.frame == stop_after) throw Cancelled();
  });
}

TEST(LivingSurface, AMorphKilledAndResumedIsTheSameAsUninterrupted) {
  const Scratch s;
  run(ball_to_ring(s / "a.####.ply"));
  MorphJobOptions b = ball_to_ring(s / "b.####.ply");
  b.output.resume = true;
  EXPECT_THROW(run(b, 3), Cancelled);
  EXPECT_FALSE(std::filesystem::exists(s / "b.0004.ply"));
  const auto third = std::filesystem::last_write_time(s / "b.0003.ply");
  run(b);
  EXPECT_EQ(std::filesystem::last_write_time(s / "b.0003.ply"), third) << "was made again";
  for (int f = 1; f <= 6; ++f) {
    const std::string name = ".000" + std::to_string(f) + ".ply";
    EXPECT_TRUE(contents(s / ("a" + name)) == contents(s / ("b" + name))) << f;
  }
}

TEST(LivingSurface, OtherShapesAreNotResumed) {
  const Scratch s;
  MorphJobOptions o = ball_to_ring(s / "a.####.ply");
  o.output.resume = true;
  EXPECT_THROW(run(o, 2), Cancelled);
  o.shapes = "others";
  const auto before = std::filesystem::last_write_time(s / "a.0001.ply");
  run(o, 100);
  EXPECT_NE(std::filesystem::last_write_time(s / "a.0001.ply"), before);
}

TEST(LivingSurface, GridsHoldTheLevelSetAndItsVelocity) {
  const Scratch s;
  MorphJobOptions o = ball_to_ring(s / "a.####.vtp");
  o.output.grids = s / "a.####.vdb";
  o.output.velocity_grids = true;
  run(o);
  EXPECT_EQ(io::vdb_grids(s / "a.0004.vdb"), (std::vector<std::string>{"surface (float)", "velocity (vec3s)"}));
  EXPECT_GT(io::read_vdb(s / "a.0004.vdb").bricks().size(), 0u);
  const std::string pvd = contents(s / "a.pvd");
  for (int f = 1; f <= 6; ++f) EXPECT_NE(pvd.find("a.000" + std::to_string(f) + ".vtp"), std::string::npos) << f;
}

TEST(LivingSurface, TheStageOfUsdFramesShowsEveryFrame) {
  const Scratch s;
  run(ball_to_ring(s / "a.####.usda"));
  const std::string stage = contents(s / "a.usda");
  for (int f = 1; f <= 6; ++f) EXPECT_NE(stage.find("a.000" + std::to_string(f) + ".usda"), std::string::npos) << f;
  EXPECT_NE(contents(s / "a.0003.usda").find("velocities"), std::string::npos);
}

TEST(LivingSurface, ParticleAttributesRideOnTheMesh) {
  // Two drops of other colour and kind: each end of the mesh shows its own.
  points::Cloud cloud;
  std::vector<double> colour;
  std::vector<std::int64_t> kind;
  for (int side = 0; side < 2; ++side)
    for (int n = 0; n < 216; ++n) {
      cloud.positions.emplace_back(10 * side + n / 36, n / 6 % 6, n % 6);
      colour.insert(colour.end(), {side ? 1.0 : 0.25, 0.5, 0});
      kind.push_back(side ? 7 : -3);
    }
  cloud.attributes.set("Cd", 3, colour);
  cloud.attributes.set_integers("kind", 1, kind);
  band::SkinOptions o;
  o.radius = 0.75;
  band::Skin skin(o);
  skin.start(cloud, 1);
  const mesh::Mesh mesh = skin_mesh(skin);
  const auto cd = mesh.attributes.values("Cd", 3);
  const auto k = mesh.attributes.integers("kind");
  ASSERT_EQ(cd.size(), 3 * mesh.positions.size());
  ASSERT_EQ(k.size(), mesh.positions.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const bool right = mesh.positions[i].x() > 6.5;
    EXPECT_NEAR(cd[3 * i], right ? 1 : 0.25, 1e-9);
    EXPECT_NEAR(cd[3 * i + 1], 0.5, 1e-9);
    EXPECT_EQ(k[i], right ? 7 : -3);
  }
}

TEST(LivingSurface, RefusesAnOutputWithoutFrameNumber) {
  const Scratch s;
  EXPECT_THROW(run(ball_to_ring(s / "a.ply")), InvalidInput);
}

}  // namespace
}  // namespace meniscus::scene
