#include "support/program.h"

#include <meniscus/io/geometry.h>
#include <meniscus/mesh/validate.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>

namespace meniscus {
namespace {

using test::meniscus_program;
using test::Scratch;

std::string scene(const std::string& name) { return std::string("'" MENISCUS_SOURCE_DIR "/scenes/") + name + "'"; }

TEST(TrackVerb, CarriesOneMeshWithVelocities) {
  const Scratch out;
  for (const std::string kind : {"blended", "total", "isometric"}) {
    const auto ran = meniscus_program("track " + scene("translating_blob.json") + " --velocity " + kind +
                                      " --voxel 0.12 --frames 1-5 --json -q -f -o '" + (out / "t.####.ply") + "'");
    ASSERT_EQ(ran.code, 0) << ran.err;
    const auto report = nlohmann::json::parse(ran.out);
    ASSERT_EQ(report["frames"].size(), 5u);
    EXPECT_EQ(report["frames"][0]["remeshed"], "first");
    for (int i = 1; i < 5; ++i) {
      EXPECT_FALSE(report["frames"][i].contains("remeshed"));
      EXPECT_LT(report["frames"][i]["area_log_max"].get<double>(), 1e-9);
      EXPECT_EQ(report["frames"][i]["flips"], 0);
      EXPECT_LT(report["frames"][i]["max_distance"].get<double>(), 1e-9);
    }
    const mesh::Mesh m = io::read_mesh(out / "t.0005.ply");
    EXPECT_TRUE(mesh::validate(m).good());
    const auto v = m.attributes.values("v", 3);
    const auto rest = m.attributes.values("rest", 3);
    ASSERT_EQ(v.size(), 3 * m.positions.size());
    ASSERT_EQ(rest.size(), v.size());
    for (std::size_t i = 0; i < m.positions.size(); ++i) {
      EXPECT_LT((Vec3(v[3 * i], v[3 * i + 1], v[3 * i + 2]) - Vec3(1, 0.25, 0)).norm(), 1e-5);
      const Vec3 moved = m.positions[i] - Vec3(rest[3 * i], rest[3 * i + 1], rest[3 * i + 2]);
      EXPECT_LT((moved - Vec3(1, 0.25, 0) * 4 / 24).norm(), 1e-5);
    }
  }
}

TEST(TrackVerb, MeshesAnewWhenTopologyChanges) {
  const Scratch out;
  const auto ran = meniscus_program("track " + scene("two_blobs.json") + " --velocity total --voxel 0.08 --json -q -o '" +
                                    (out / "t.####.ply") + "'");
  ASSERT_EQ(ran.code, 0) << ran.err;
  const auto report = nlohmann::json::parse(ran.out);
  std::size_t changes = 0;
  std::size_t anew = 0;
  for (const auto& f : report["frames"]) {
    changes += f.value("remeshed", "") == "topology" ? 1 : 0;
    anew += f.contains("remeshed") ? 1 : 0;
  }
  EXPECT_EQ(changes, 2u);
  EXPECT_LT(anew, 12u);
  for (const auto& o : report["outputs"]) EXPECT_TRUE(mesh::validate(io::read_mesh(o["path"])).good()) << o["path"];
}

TEST(TrackVerb, AStickThroughABlobDoesNotFoldTheMesh) {
  const Scratch out;
  for (const std::string kind : {"normal", "blended", "isometric"}) {
    const auto ran = meniscus_program("track " + scene("stick_through_blob.json") + " --velocity " + kind +
                                      " --voxel 0.1 --frames 1-60x2 --json -q -f -o '" + (out / "t.####.ply") + "'");
    ASSERT_EQ(ran.code, 0) << ran.err;
    const auto report = nlohmann::json::parse(ran.out);
    std::size_t anew = 0;
    for (std::size_t i = 0; i < report["frames"].size(); ++i) {
      const auto& f = report["frames"][i];
      anew += f.contains("remeshed") ? 1 : 0;
      EXPECT_LE(f["flips"].get<double>(), 0.01 * report["outputs"][i]["triangles"].get<double>());
      EXPECT_LT(f["max_distance"].get<double>(), 1e-4);
    }
    EXPECT_LT(anew, report["frames"].size() / 2) << kind;
  }
}

TEST(TrackVerb, CarriesPoints) {
  const Scratch out;
  const auto ran =
      meniscus_program("track " + scene("three_blobs.json") +
                       " --as points --velocity isometric --voxel 0.15 --frames 1-3 -q -o '" + (out / "p.####.ply") + "'");
  ASSERT_EQ(ran.code, 0) << ran.err;
  const auto first = io::read_geometry(out / "p.0001.ply");
  const auto last = io::read_geometry(out / "p.0003.ply");
  ASSERT_EQ(last.kind, io::Geometry::Kind::Cloud);
  EXPECT_EQ(first.cloud.size(), last.cloud.size());
  EXPECT_FALSE(last.cloud.attributes.values("v", 3).empty());
  EXPECT_FALSE(last.cloud.attributes.integers("id").empty());
}

TEST(TrackVerb, RefusesWhatHasNoMeaning) {
  const Scratch out;
  const std::string to = " -q -o '" + (out / "x.####.ply") + "'";
  EXPECT_EQ(meniscus_program("track " + scene("two_blobs.json") + " --velocity fast" + to).code, 2);
  EXPECT_EQ(meniscus_program("track " + scene("two_blobs.json") + " --voxel 0" + to).code, 2);
  EXPECT_EQ(meniscus_program("track " + scene("two_blobs.json") + " --as points --fairing 3" + to).code, 2);
  EXPECT_EQ(meniscus_program("track " + scene("two_blobs.json") + " -q -o '" + (out / "x.ply") + "'").code, 2);
  EXPECT_EQ(meniscus_program("track /nowhere.json" + to).code, 3);
}

}  // namespace
}  // namespace meniscus
