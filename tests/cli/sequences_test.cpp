// The verbs that make points and moving surfaces, as a user runs them.
#include "support/program.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <filesystem>

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

TEST(SkinVerb, BadInputIsAnError) {
  const Scratch s;
  EXPECT_EQ(meniscus_program("skin " + (s / "none.####.ply") + " -o " + (s / "o.####.ply")).code, 3);
  EXPECT_EQ(meniscus_program(kSkin + "--frames 90-91 -o " + (s / "o.####.ply")).code, 3);
  EXPECT_EQ(meniscus_program("skin " + kDrops + " --radius -1 -o " + (s / "o.####.ply")).code, 2);
  EXPECT_TRUE(std::filesystem::is_empty(std::filesystem::path(s / "x").parent_path()));
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

TEST(SampleVerb, ExactCountEvenAndOnTheSurface) {
  const Scratch s;
  const auto r = meniscus_program("sample " + kScenes + "three_blobs.json --count 500 --json -q -o " + (s / "p.ply"));
  ASSERT_EQ(r.code, 0) << r.err;
  const auto sampling = nlohmann::json::parse(r.out)["sampling"];
  EXPECT_EQ(sampling["count"], 500);
  EXPECT_GE(sampling["packing"].get<double>(), 0.85);
  EXPECT_LE(sampling["max_distance"].get<double>(), 1e-9 * 5);
}

TEST(SampleVerb, SameBitsForAnyThreadCount) {
  const Scratch s;
  std::string one;
  for (const int threads : {1, 2, 3, 5, 8}) {
    const std::string out = s / (std::to_string(threads) + ".csv");
    ASSERT_EQ(meniscus_program("sample " + kScenes + "two_blobs.json --count 200 -q -o " + out + " --threads " +
                               std::to_string(threads))
                  .code,
              0);
    const std::string body = contents(out);
    if (one.empty()) one = body;
    EXPECT_TRUE(body == one) << threads << " threads";
  }
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
