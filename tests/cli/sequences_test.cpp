// The verbs that make points and moving surfaces, as a user runs them.
#include "support/program.h"

#include <meniscus/io/geometry.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <set>

namespace meniscus {
namespace {

using test::contents;
using test::meniscus_program;
using test::Scratch;

const std::string kScenes = MENISCUS_SOURCE_DIR "/scenes/";
const std::string kDrops = MENISCUS_SOURCE_DIR "/examples/data/drops.lammpstrj.gz";
const std::string kSkin = "skin " + kDrops + " --fps 1 --radius 0.8 --voxel 0.6 --min-neighbours 3 -q ";

void write(const std::string& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

TEST(SkinVerb, MakesClosedMeshesThatKeepTheirVolumeAndCarryVelocities) {
  const Scratch s;
  const auto r = meniscus_program(kSkin + "--frames 1-4 --json -o " + (s / "skin.####.ply"));
  ASSERT_EQ(r.code, 0) << r.err;
  const auto report = nlohmann::json::parse(r.out);
  ASSERT_EQ(report["frames"].size(), 4u);
  const double first = report["frames"][0]["volume"];
  for (const auto& f : report["frames"]) EXPECT_NEAR(f["volume"].get<double>(), first, 0.005 * first) << f;
  EXPECT_EQ(meniscus_program("check '" + (s / "skin.####.ply") + "'").code, 0);
  const auto info = nlohmann::json::parse(meniscus_program("info --json " + (s / "skin.0003.ply")).out);
  std::string names;
  for (const auto& a : info["info"]["attributes"]) names += a["name"].get<std::string>() + " ";
  EXPECT_NE(names.find("v "), std::string::npos) << names;
  EXPECT_NE(names.find("N "), std::string::npos) << names;
}

TEST(SkinVerb, ResumedIsTheSameAsUninterruptedForAnyThreadCount) {
  const Scratch s;
  const std::string options = kSkin + "--force --resume -o ";
  ASSERT_EQ(meniscus_program(options + (s / "a.####.ply") + " --frames 1-4 --threads 1").code, 0);
  ASSERT_EQ(meniscus_program(options + (s / "b.####.ply") + " --frames 1-2 --threads 2").code, 0);
  ASSERT_EQ(meniscus_program(options + (s / "b.####.ply") + " --frames 1-4 --threads 3").code, 0);
  for (const char* f : {"0001", "0002", "0003", "0004"})
    EXPECT_TRUE(contents(s / (std::string("a.") + f + ".ply")) == contents(s / (std::string("b.") + f + ".ply"))) << f;
}

/// Ids of a mesh's vertices.
std::set<std::int64_t> ids_of(const std::string& path) {
  const auto mesh = io::read_mesh(path);
  const auto ids = mesh.attributes.integers("id");
  return {ids.begin(), ids.end()};
}

TEST(SkinVerb, PersistentVerticesKeepTheirIdsAndTheReportSaysWhereNot) {
  const Scratch s;
  const std::string options = kSkin + "--tension 0.96 --persistent --force --resume --json -o ";
  const auto r = meniscus_program(options + (s / "a.####.ply") + " --frames 1-6");
  ASSERT_EQ(r.code, 0) << r.err;
  EXPECT_EQ(meniscus_program("check '" + (s / "a.####.ply") + "'").code, 0);
  const auto frames = nlohmann::json::parse(r.out)["frames"];
  const auto manifest = nlohmann::json::parse(contents(s / "a.manifest.json"))["frames"];
  ASSERT_EQ(manifest.size(), 6u);
  EXPECT_EQ(frames[0]["remeshed"], "first");
  auto before = ids_of(s / "a.0001.ply");
  for (std::size_t f = 1; f < 6; ++f) {
    const auto now = ids_of(s / ("a.000" + std::to_string(f + 1) + ".ply"));
    const auto kept = static_cast<std::size_t>(
        std::count_if(now.begin(), now.end(), [&](std::int64_t id) { return before.contains(id); }));
    EXPECT_EQ(frames[f]["carried"], kept) << frames[f];
    EXPECT_GT(kept, 9 * before.size() / 10);
    if (frames[f]["remeshed"] == "")
      EXPECT_TRUE(now == before && frames[f]["regions"].empty());
    else
      EXPECT_FALSE(frames[f]["regions"].empty());
    for (const char* key : {"remeshed", "regions", "carried"}) EXPECT_EQ(manifest[f][key], frames[f][key]) << key;
    before = now;
  }
  const auto mesh = io::read_mesh(s / "a.0004.ply");
  EXPECT_EQ(mesh.attributes.values("v", 3).size(), 3 * mesh.positions.size());
  EXPECT_EQ(mesh.attributes.values("rest", 3).size(), 3 * mesh.positions.size());

  ASSERT_EQ(meniscus_program(options + (s / "b.####.ply") + " --frames 1-3 --threads 1").code, 0);
  ASSERT_EQ(meniscus_program(options + (s / "b.####.ply") + " --frames 1-6 --threads 3").code, 0);
  for (const char* f : {"0004", "0005", "0006"})
    EXPECT_TRUE(contents(s / (std::string("a.") + f + ".ply")) == contents(s / (std::string("b.") + f + ".ply"))) << f;
}

TEST(SkinVerb, BadInputIsAnError) {
  const Scratch s;
  EXPECT_EQ(meniscus_program("skin " + (s / "none.####.ply") + " -o " + (s / "o.####.ply")).code, 3);
  EXPECT_EQ(meniscus_program(kSkin + "--frames 90-91 -o " + (s / "o.####.ply")).code, 3);
  EXPECT_EQ(meniscus_program("skin " + kDrops + " --radius -1 -o " + (s / "o.####.ply")).code, 2);
  EXPECT_TRUE(std::filesystem::is_empty(std::filesystem::path(s / "x").parent_path()));
  write(s / "no_frames.lammpstrj", "");
  EXPECT_EQ(meniscus_program("skin " + (s / "no_frames.lammpstrj") + " --radius 1 -o " + (s / "o.####.ply")).code, 3);
}

TEST(Sequences, AnOutputWithoutAPlaceForTheNumberIsAUsageErrorUnlessThereIsOneFrame) {
  const Scratch s;
  const std::string one = s / "one.ply", two = s / "o.####.ply --vdb " + (s / "one.vdb");
  const std::string skin = kSkin + "--frames 7-8 ", morph = "morph " + kScenes + "ball.json " + kScenes + "six_lobes.json ",
                    track = "track " + kScenes + "translating_blob.json ";
  for (const std::string& verb : {skin, morph, track})
    for (const std::string& output : {one, two}) {
      const auto r = meniscus_program(verb + "-o " + output);
      EXPECT_EQ(r.code, 2) << verb << output;
      EXPECT_NE(r.err.find("####"), std::string::npos) << r.err;
    }
  EXPECT_TRUE(std::filesystem::is_empty(std::filesystem::path(one).parent_path()));
  EXPECT_EQ(meniscus_program(kSkin + "--frames 8 -o " + one).code, 0);
  EXPECT_EQ(meniscus_program("check " + one).code, 0);
}

TEST(SkinVerb, OneParticleAndCoincidentParticlesGiveABall) {
  const Scratch s;
  write(s / "p.0001.csv", "x,y,z\n0,0,0\n");
  write(s / "p.0002.csv", "x,y,z\n0,0,0\n0,0,0\n0,0,0\n");
  const auto r =
      meniscus_program("skin '" + (s / "p.####.csv") + "' --radius 1 --voxel 0.1 --tension 0 -q -o " + (s / "o.####.ply"));
  ASSERT_EQ(r.code, 0) << r.err;
  EXPECT_EQ(meniscus_program("check '" + (s / "o.####.ply") + "'").code, 0);
}

/// `side`³ particles one apart, with ids from `first`, as CSV.
std::string block(int side, int first = 0) {
  std::string text = "id,x,y,z\n";
  for (int n = 0; n < side * side * side; ++n)
    text += std::to_string(first + n) + "," + std::to_string(n / (side * side)) + "," + std::to_string(n / side % side) +
            "," + std::to_string(n % side) + "\n";
  return text;
}

/// Warnings of the report by code.
std::string warning(const nlohmann::json& report, const std::string& code) {
  for (const auto& w : report["warnings"])
    if (w["code"] == code) return w["message"];
  return "";
}

TEST(SkinVerb, FramesMayBeEmptyAndChangeCountsAndIds) {
  const Scratch s;
  write(s / "p.0001.csv", block(5));
  write(s / "p.0002.csv", "id,x,y,z\n");
  write(s / "p.0003.csv", block(6, 1000));
  write(s / "p.0004.csv", block(4));
  const auto r = meniscus_program("skin '" + (s / "p.####.csv") + "' --radius 0.75 --json -q -o " + (s / "o.####.ply"));
  ASSERT_EQ(r.code, 0) << r.err;
  const auto frames = nlohmann::json::parse(r.out)["frames"];
  ASSERT_EQ(frames.size(), 4u);
  EXPECT_EQ(frames[0]["components"], 1);
  EXPECT_EQ(frames[1]["particles"], 0);
  EXPECT_EQ(frames[1]["triangles"], 0);
  EXPECT_EQ(frames[2]["components"], 1);
  EXPECT_GT(frames[2]["volume"].get<double>(), 1.3 * frames[0]["volume"].get<double>());
  EXPECT_EQ(frames[3]["components"], 1);
  EXPECT_EQ(meniscus_program("check '" + (s / "o.####.ply") + "'").code, 0);
}

TEST(SkinVerb, SaysHowManyParticlesAreUnusable) {
  const Scratch s;
  write(s / "p.0001.csv", block(4) + "100,nan,0,0\n101,0,inf,0\n102,1e30,0,0\n");
  const auto r = meniscus_program("skin '" + (s / "p.####.csv") + "' --radius 0.75 --json -q -o " + (s / "o.####.ply"));
  ASSERT_EQ(r.code, 0) << r.err;
  const std::string message = warning(nlohmann::json::parse(r.out), "dropped-points");
  EXPECT_EQ(message.substr(0, 8), "3 points") << message;
  EXPECT_EQ(meniscus_program("check '" + (s / "o.0001.ply") + "'").code, 0);
}

TEST(SkinVerb, SaysHowManyParticlesAreTooSmallForTheVoxels) {
  const Scratch s;
  std::string text = "x,y,z\n";
  for (int i = 0; i < 25; ++i) text += std::to_string(1.37 * i) + "," + std::to_string(0.41 * i) + ",0.3\n";
  write(s / "p.0001.csv", text);
  const std::string run = "skin '" + (s / "p.####.csv") + "' --radius 0.05 --json -q --force -o " + (s / "o.####.ply");
  const auto coarse = meniscus_program(run + " --voxel 0.5");
  ASSERT_EQ(coarse.code, 0) << coarse.err;
  const std::string message = warning(nlohmann::json::parse(coarse.out), "lost-particles");
  const auto lost = nlohmann::json::parse(coarse.out)["frames"][0]["lost"].get<int>();
  EXPECT_GT(lost, 20);
  EXPECT_NE(message.find("to " + std::to_string(lost) + " particles"), std::string::npos) << message;
  const auto fine = meniscus_program(run);
  ASSERT_EQ(fine.code, 0) << fine.err;
  EXPECT_EQ(warning(nlohmann::json::parse(fine.out), "lost-particles"), "");
  EXPECT_EQ(nlohmann::json::parse(fine.out)["frames"][0]["components"], 25);
}

TEST(SkinVerb, RefusesAVoxelThatMemoryCannotHoldAndSaysTheFigure) {
  const Scratch s;
  write(s / "p.0001.csv", block(10));
  const std::string run = "skin '" + (s / "p.####.csv") + "' --radius 0.75 -q --force -o " + (s / "o.####.ply");
  const auto r = meniscus_program(run + " --voxel 0.0005");
  EXPECT_EQ(r.code, 1);
  EXPECT_NE(r.err.find("GB"), std::string::npos) << r.err;
  EXPECT_FALSE(std::filesystem::exists(s / "o.0001.ply"));
  EXPECT_EQ(meniscus_program(run + " --memory 0.001").code, 1);
  EXPECT_EQ(meniscus_program(run + " --memory 1").code, 0);
}

TEST(MorphVerb, TurnsABallIntoARing) {
  const Scratch s;
  write(s / "ball.json",
        R"({"format":"meniscus.scene","version":1,"surface":{"type":"sphere","center":[0,0,0],"radius":1}})");
  write(s / "ring.json",
        R"({"format":"meniscus.scene","version":1,"surface":{"type":"torus","center":[0,0,0],"major":1,"minor":0.35}})");
  const auto r = meniscus_program("morph " + (s / "ball.json") + " " + (s / "ring.json") +
                                  " --frames 6 --voxel 0.06 -q -o " + (s / "m.####.ply"));
  ASSERT_EQ(r.code, 0) << r.err;
  const auto last = nlohmann::json::parse(meniscus_program("check --json " + (s / "m.0006.ply")).out);
  EXPECT_TRUE(last["check"][0]["good"].get<bool>()) << last;
  EXPECT_EQ(last["check"][0]["euler"], 0);
}

TEST(MorphVerb, NeedsNoChangeOfTopologyToGrowSixLobes) {
  const Scratch s;
  const auto r = meniscus_program("morph " + kScenes + "ball.json " + kScenes +
                                  "six_lobes.json --frames 8 --voxel 0.1 -q -o " + (s / "m.####.ply"));
  ASSERT_EQ(r.code, 0) << r.err;
  const auto frames = nlohmann::json::parse(meniscus_program("check --json '" + (s / "m.####.ply") + "'").out)["check"];
  ASSERT_EQ(frames.size(), 8u);
  for (const auto& f : frames) EXPECT_TRUE(f["good"] && f["components"] == 1 && f["euler"] == 2) << f;
}

TEST(MorphVerb, VerticesPersistWhereTheTopologyStays) {
  const Scratch s;
  const auto r = meniscus_program("morph " + kScenes + "ball.json " + kScenes +
                                  "six_lobes.json --frames 12 --voxel 0.1 --persistent --json -q -o " + (s / "m.####.ply"));
  ASSERT_EQ(r.code, 0) << r.err;
  EXPECT_EQ(meniscus_program("check '" + (s / "m.####.ply") + "'").code, 0);
  const auto report = nlohmann::json::parse(r.out);
  ASSERT_EQ(report["frames"].size(), 12u);
  for (const auto& f : report["frames"]) EXPECT_NE(f["remeshed"], "topology");
  const auto first = ids_of(s / "m.0001.ply"), second = ids_of(s / "m.0004.ply");
  EXPECT_TRUE(first == second);
}

TEST(MorphVerb, SixLobesPartIntoTwoSpheres) {
  const Scratch s;
  const double volume = 2 * 4.0 / 3 * 3.14159265 * 0.216;
  double error[2];
  for (const int finer : {0, 1}) {
    const auto r =
        meniscus_program("morph " + kScenes + "six_lobes.json " + kScenes + "two_spheres.json --frames 12 --voxel " +
                         (finer != 0 ? "0.05" : "0.1") + " --tension 0.05 --json -q --force -o " + (s / "m.####.ply"));
    ASSERT_EQ(r.code, 0) << r.err;
    const auto report = nlohmann::json::parse(r.out);
    EXPECT_EQ(report["frames"].front()["components"], 1);
    EXPECT_EQ(report["frames"].back()["components"], 2);
    EXPECT_LT(report["frames"].back()["distance_to_goal"].get<double>(), 0.02);
    EXPECT_EQ(warning(report, "no-overlap"), "");
    EXPECT_EQ(meniscus_program("check '" + (s / "m.####.ply") + "'").code, 0);
    error[finer] = 1 - report["frames"].back()["volume"].get<double>() / volume;
  }
  // The surface lies on its goal; what is missing is the measure's, which cuts the bulge of every cell off:
  // (voxel/radius)²/2 of a sphere, a quarter at half the voxel.
  EXPECT_NEAR(error[0], 0.5 / 36, 0.1 * 0.5 / 36);
  EXPECT_NEAR(error[1], error[0] / 4, 0.1 * error[0] / 4);
}

TEST(MorphVerb, SaysThatShapesDoNotMeet) {
  const Scratch s;
  write(s / "far.json",
        R"({"format":"meniscus.scene","version":1,"surface":{"type":"sphere","center":[4,0,0],"radius":1}})");
  const auto r = meniscus_program("morph " + kScenes + "ball.json " + (s / "far.json") +
                                  " --frames 5 --voxel 0.12 --json -q -o " + (s / "m.####.ply"));
  ASSERT_EQ(r.code, 0) << r.err;
  const auto report = nlohmann::json::parse(r.out);
  EXPECT_NE(warning(report, "no-overlap").find("grow"), std::string::npos);
  EXPECT_EQ(report["frames"].back()["components"], 1);
  EXPECT_NEAR(report["frames"].back()["volume"].get<double>(), 4.0 / 3 * 3.14159265, 0.05);
}

TEST(SampleVerb, ExactCountEvenAndOnTheSurface) {
  const Scratch s;
  const auto r = meniscus_program("sample " + kScenes + "three_blobs.json --count 500 --json -q -o " + (s / "p.ply"));
  ASSERT_EQ(r.code, 0) << r.err;
  const auto sampling = nlohmann::json::parse(r.out)["sampling"];
  EXPECT_EQ(sampling["count"], 500);
  EXPECT_GE(sampling["packing"].get<double>(), 0.85);
  EXPECT_LE(sampling["max_distance"].get<double>(), 1e-9 * 5);
}

TEST(SampleVerb, BadInputIsAnErrorNotAHang) {
  const Scratch s;
  const std::string scene = kScenes + "two_blobs.json -q -o " + (s / "p.ply");
  EXPECT_EQ(meniscus_program("sample " + scene + " --spacing 0").code, 2);
  EXPECT_EQ(meniscus_program("sample " + scene + " --spacing -1").code, 2);
  write(
      s / "nan.json",
      R"j({"format":"meniscus.scene","version":1,"surface":{"type":"expression","f":"sqrt(-1-x^2)","bounds":[[-1,-1,-1],[1,1,1]]}})j");
  const auto r =
      meniscus_program("sample " + (s / "nan.json") + " --spacing 0.1 --json -q -o " + (s / "n.ply"), "timeout 60");
  EXPECT_NE(r.code, 124) << "hangs";
}

}  // namespace
}  // namespace meniscus
