#include "motion/moving_scenes.h"
#include "support/program.h"

#include <meniscus/io/geometry.h>
#include <meniscus/io/vdb.h>
#include <meniscus/mesh/validate.h>
#include <meniscus/motion/velocity.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <map>

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
      EXPECT_EQ(report["frames"][i]["remeshed"], "");
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

TEST(TrackVerb, MendsTheMeshWhereBlobsMeetAndPart) {
  // Two blobs merge and split again within 200 frames.
  const Scratch out;
  const auto ran = meniscus_program("track " + scene("two_blobs.json") +
                                    " --fps 100 --frames 1-200 --voxel 0.1 --json -q -o '" + (out / "t.####.ply") + "'");
  ASSERT_EQ(ran.code, 0) << ran.err;
  const auto report = nlohmann::json::parse(ran.out);
  ASSERT_EQ(report["frames"].size(), 200u);
  std::size_t changes = 0;
  std::map<std::int64_t, Vec3> places;  // of vertices, by id
  std::map<std::int64_t, Vec3> rests;
  for (std::size_t i = 0; i < 200; ++i) {
    const auto& f = report["frames"][i];
    const mesh::Mesh m = io::read_mesh(report["outputs"][i]["path"]);
    const mesh::Audit audit = mesh::validate(m);
    ASSERT_TRUE(audit.good()) << f["frame"] << ' ' << mesh::summary(audit);
    const auto ids = m.attributes.integers("id");
    const auto rest = m.attributes.values("rest", 3);
    ASSERT_EQ(ids.size(), m.positions.size());
    ASSERT_EQ(rest.size(), 3 * m.positions.size());
    std::map<std::int64_t, Vec3> now;
    std::size_t kept = 0;
    for (std::size_t k = 0; k < ids.size(); ++k) {
      now[ids[k]] = m.positions[k];
      const auto was = places.find(ids[k]);
      const Vec3 origin(rest[3 * k], rest[3 * k + 1], rest[3 * k + 2]);
      if (was != places.end()) {
        ++kept;
        EXPECT_EQ(origin, rests[ids[k]]) << "what a vertex carries stays with it";
        EXPECT_LT((m.positions[k] - was->second).norm(), 0.1) << f["frame"];
      } else if (i > 0) {
        EXPECT_LT(std::abs(m.positions[k].x()), 0.8) << "new vertices are near the neck alone";
      }
      rests[ids[k]] = origin;
    }
    EXPECT_EQ(now.size(), ids.size()) << "ids are unique";
    if (i > 0 && f["remeshed"] == "") EXPECT_EQ(kept, ids.size());
    if (i > 0 && f["remeshed"] != "") {
      changes += f["remeshed"] == "topology" ? 1 : 0;
      EXPECT_EQ(f["carried"], kept);
      EXPECT_LE(f["regions"].size(), 2u);
      EXPECT_GT(static_cast<double>(kept), 0.9 * static_cast<double>(ids.size()));
    }
    places = std::move(now);
  }
  EXPECT_EQ(changes, 2u);
}

TEST(TrackVerb, AStickThroughABlobDoesNotFoldTheMesh) {
  const Scratch out;
  for (const std::string kind : {"normal", "blended", "isometric"}) {
    const auto ran = meniscus_program("track " + scene("stick_through_blob.json") + " --velocity " + kind +
                                      " --voxel 0.1 --frames 1-60x2 --json -q -f -o '" + (out / "t.####.ply") + "'");
    ASSERT_EQ(ran.code, 0) << ran.err;
    const auto report = nlohmann::json::parse(ran.out);
    double kept = 0;
    double of = 0;
    for (std::size_t i = 0; i < report["frames"].size(); ++i) {
      const auto& f = report["frames"][i];
      const auto& o = report["outputs"][i];
      EXPECT_LE(f["flips"].get<double>(), 0.01 * o["triangles"].get<double>());
      EXPECT_LT(f["max_distance"].get<double>(), 1e-4);
      const mesh::Mesh m = io::read_mesh(o["path"]);
      EXPECT_TRUE(mesh::validate(m).good());
      const auto v = m.attributes.values("v", 3);
      // The stick has speed 1.6; a slide beyond a part's motion is at most twice what asks for it.
      for (std::size_t k = 0; k < v.size(); k += 3) EXPECT_LT(Vec3(v[k], v[k + 1], v[k + 2]).norm(), 3 * 1.6) << kind;
      if (i == 0 || f["remeshed"] == "") continue;
      kept += f["carried"].get<double>();
      of += o["points"].get<double>();
      EXPECT_GT(f["carried"], 0) << "never meshed anew as a whole";
    }
    // The crease runs over the mesh, which is mended there alone.
    EXPECT_GT(kept, 0.8 * of) << kind;
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

TEST(TrackVerb, EveryFormatHoldsTheVelocityOfTheVertexAsWritten) {
  const Scratch out;
  const auto track = [&](const std::string& extension) {
    const std::string path = out / ("t.####." + extension);
    const auto ran = meniscus_program("track " + scene("approaching_blobs.json") +
                                      " --voxel 0.15 --frames 3-5 --fairing 4 --velocity total -q -o '" + path + "'");
    EXPECT_EQ(ran.code, 0) << ran.err;
    return out / ("t.0005." + extension);
  };
  // The blobs of the scene.
  const field::Blob blobs[] = {{{test::moving("-0.85+0.9*t"), test::moving("0.25*t"), 0.0}, 1.2},
                               {{test::moving("0.85-0.9*t"), test::moving("-0.15*t"), 0.1}, 1.05}};
  const auto f = field::blobs(field::BlobKernel::Compact, 0.35, blobs);
  f->set_time(5.0 / 24);
  for (const std::string extension : {"ply", "vtp"}) {
    const mesh::Mesh m = io::read_mesh(track(extension));
    const auto v = m.attributes.values("v", 3);
    ASSERT_EQ(v.size(), 3 * m.positions.size());
    EXPECT_EQ(m.attributes.integers("singular").size(), m.positions.size());
    const auto wanted = motion::velocities(*f, m.positions, {.kind = motion::Velocity::Total});
    for (std::size_t i = 0; i < m.positions.size(); ++i)
      EXPECT_LT((Vec3(v[3 * i], v[3 * i + 1], v[3 * i + 2]) - wanted.velocity[i]).norm(), 1e-3);
  }
  EXPECT_NE(test::contents(track("usda")).find("vector3f[] velocities"), std::string::npos);
  EXPECT_NE(test::contents(out / "t.usda").find("t.0005.usda"), std::string::npos);
}

TEST(TrackVerb, WritesLevelSetsWithVelocitiesAndCarriesAMeshOfOnesOwn) {
  const Scratch out;
  const auto track = [&](const std::string& more) {
    return meniscus_program("track " + scene("translating_blob.json") + " --voxel 0.12 --json -q -o '" +
                            (out / "t.####.ply") + "' " + more);
  };
  ASSERT_EQ(track("--frames 1-2 --checker 0.3").code, 0);
  const auto ran = track("-f --frames 1-3 --start '" + (out / "t.0001.ply") + "' --vdb '" + (out / "t.####.vdb") + "'");
  ASSERT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(nlohmann::json::parse(ran.out)["inputs"].size(), 2u);
  EXPECT_EQ(io::vdb_grids(out / "t.0003.vdb"), (std::vector<std::string>{"surface (float)", "velocity (vec3s)"}));
  const mesh::Mesh m = io::read_mesh(out / "t.0003.ply");
  const auto color = m.attributes.values("Cd", 3);
  ASSERT_EQ(color.size(), 3 * m.positions.size());
  std::size_t dark = 0;
  for (std::size_t i = 0; i < m.positions.size(); ++i) dark += color[3 * i + 2] < 0.4 ? 1 : 0;
  EXPECT_GT(dark, m.positions.size() / 4);
  EXPECT_LT(dark, 3 * m.positions.size() / 4);
}

TEST(TrackVerb, RefusesWhatHasNoMeaning) {
  const Scratch out;
  const std::string to = " -q -o '" + (out / "x.####.ply") + "'";
  EXPECT_EQ(meniscus_program("track " + scene("two_blobs.json") + " --velocity fast" + to).code, 2);
  EXPECT_EQ(meniscus_program("track " + scene("two_blobs.json") + " --voxel 0" + to).code, 2);
  EXPECT_EQ(meniscus_program("track " + scene("two_blobs.json") + " --as points --fairing 3" + to).code, 2);
  EXPECT_EQ(meniscus_program("track " + scene("two_blobs.json") + " -q -o '" + (out / "x.ply") + "'").code, 2);
  EXPECT_EQ(meniscus_program("track " + scene("two_blobs.json") + " --vdb '" + (out / "x.vdb") + "'" + to).code, 2);
  EXPECT_EQ(meniscus_program("track " + scene("two_blobs.json") + " --start /nowhere.ply" + to).code, 2);
  EXPECT_EQ(meniscus_program("track " + scene("two_blobs.json") + " --start " + scene("ball.json") + to).code, 3);
  EXPECT_EQ(meniscus_program("track /nowhere.json" + to).code, 3);
}

}  // namespace
}  // namespace meniscus
