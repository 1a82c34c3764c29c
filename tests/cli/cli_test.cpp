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

void write(const std::string& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

const char* kBall = R"({"format":"meniscus.scene","version":1,"surface":{"type":"sphere","center":[0,0,0],"radius":1}})";

TEST(RenderVerb, DrawsScenesAndMeshes) {
  const Scratch s;
  write(s / "ball.json", kBall);
  ASSERT_EQ(meniscus_program("mesh " + (s / "ball.json") + " --voxel 0.2 -o " + (s / "b.ply")).code, 0);
  for (const char* file : {"ball.json", "b.ply"}) {
    const auto r = meniscus_program("render " + (s / file) + " --size 40x30 --samples 1 -f -o " + (s / "picture.png"));
    EXPECT_EQ(r.code, 0) << file << ": " << r.err;
    EXPECT_EQ(contents(s / "picture.png").substr(1, 3), "PNG") << file;
  }
}

TEST(CommandLine, HelpLeadsWithAnExampleAndExitsZero) {
  EXPECT_NE(meniscus_program("--help").out.find("Example: meniscus"), std::string::npos);
  for (const std::string verb : {"info", "mesh", "render", "convert", "edit", "check", "schema", "completion"}) {
    const auto r = meniscus_program(verb + " --help");
    EXPECT_EQ(r.code, 0) << verb;
    EXPECT_NE(r.out.find("Example: meniscus " + verb), std::string::npos) << r.out;
    EXPECT_EQ(r.err, "") << verb;
  }
}

TEST(CommandLine, VersionIsData) {
  const auto r = meniscus_program("--version");
  EXPECT_EQ(r.code, 0);
  EXPECT_EQ(r.out.rfind("meniscus ", 0), 0u) << r.out;
}

TEST(CommandLine, SlipsAreExplained) {
  const auto verb = meniscus_program("mehs x.ply -o y.ply");
  EXPECT_EQ(verb.code, 2);
  EXPECT_NE(verb.err.find("did you mean 'mesh'"), std::string::npos) << verb.err;
  const auto option = meniscus_program("mesh x.ply -o y.ply --voxl 0.1");
  EXPECT_EQ(option.code, 2);
  EXPECT_NE(option.err.find("did you mean '--voxel'"), std::string::npos) << option.err;
  EXPECT_EQ(meniscus_program("").code, 2);
  EXPECT_EQ(meniscus_program("mesh").code, 2);
  EXPECT_EQ(meniscus_program("render " + kScenes + "gyroid.json -o x.png --size big").code, 2);
}

TEST(CommandLine, ExitCodesTellWhatWentWrong) {
  const Scratch s;
  EXPECT_EQ(meniscus_program("mesh " + (s / "missing.ply") + " -o " + (s / "o.ply")).code, 3);
  write(s / "broken.ply", "ply\nformat ascii 1.0\nelement vertex 3\n");
  const auto broken = meniscus_program("info " + (s / "broken.ply"));
  EXPECT_EQ(broken.code, 3);
  EXPECT_NE(broken.err.find("broken.ply"), std::string::npos);
  write(s / "ball.json", kBall);
  const std::string out = s / "ball.ply";
  EXPECT_EQ(meniscus_program("mesh " + (s / "ball.json") + " --voxel 0.1 -o " + out).code, 0);
  const auto exists = meniscus_program("mesh " + (s / "ball.json") + " --voxel 0.1 -o " + out);
  EXPECT_EQ(exists.code, 4);
  EXPECT_NE(exists.err.find("force"), std::string::npos) << exists.err;
  EXPECT_EQ(meniscus_program("mesh " + (s / "ball.json") + " --voxel 0.1 --force -o " + out).code, 0);
  EXPECT_EQ(meniscus_program("mesh " + (s / "ball.json") + " --voxel 0.1 -o " + (s / "no/such/folder.ply")).code, 4);
  // A mesh with a hole is produced data that does not pass.
  write(s / "open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(meniscus_program("check " + (s / "open.obj")).code, 5);
}

TEST(CommandLine, MeshesOfScenesPassTheCheck) {
  const Scratch s;
  for (const std::string scene :
       {"two_blobs", "three_blobs", "gyroid", "genus_two", "csg_part", "fifty_spheres", "torus_knot", "mesh_blend"}) {
    const std::string out = s / (scene + ".ply");
    const auto made = meniscus_program("mesh " + kScenes + scene + ".json -o " + out + " --json" +
                                       (scene == "fifty_spheres" ? " --voxel 0.012" : ""));
    ASSERT_EQ(made.code, 0) << scene << ": " << made.err;
    const auto report = nlohmann::json::parse(made.out);
    EXPECT_TRUE(report["mesh"]["closed"].get<bool>() && report["mesh"]["manifold"].get<bool>()) << scene;
    if (scene == "fifty_spheres") EXPECT_EQ(report["mesh"]["components"], 50);
    if (scene == "genus_two") EXPECT_EQ(report["mesh"]["euler"], -2);
    const auto checked = meniscus_program("check " + out);
    EXPECT_EQ(checked.code, 0) << checked.out << checked.err;
  }
}

TEST(CommandLine, StdoutIsDataAndReportsAreJson) {
  const Scratch s;
  write(s / "ball.json", kBall);
  const auto r = meniscus_program("mesh " + (s / "ball.json") + " --voxel 0.1 -o " + (s / "b.obj") + " --json");
  const auto report = nlohmann::json::parse(r.out);
  EXPECT_EQ(report["status"], "ok");
  EXPECT_NEAR(report["mesh"]["volume"].get<double>(), 4.18879, 0.03);
  EXPECT_EQ(report["mesh"]["euler"], 2);
  EXPECT_EQ(report["outputs"][0]["triangles"], report["mesh"]["triangles"]);
  const auto quiet = meniscus_program("mesh " + (s / "ball.json") + " --voxel 0.1 -q -o " + (s / "c.obj"));
  EXPECT_EQ(quiet.out + quiet.err, "");
  const auto failed = meniscus_program("mesh " + (s / "nothing.json") + " -o " + (s / "d.obj") + " --json");
  EXPECT_EQ(nlohmann::json::parse(failed.out)["status"], "error");
}

TEST(CommandLine, AnyInputMayComeThroughAPipe) {
  const Scratch s;
  write(s / "ball.json", kBall);
  write(s / "drops.csv", "x,y,z\n0,0,0\n0.5,0,0\n0,0.5,0\n");
  const auto made = [&](const std::string& line) { ASSERT_EQ(meniscus_program(line).code, 0) << line; };
  made("mesh " + (s / "ball.json") + " --voxel 0.2 -o " + (s / "ball.ply"));
  made("sample " + (s / "ball.json") + " --count 200 -o " + (s / "points.ply"));
  made("fit " + (s / "points.ply") + " -o " + (s / "points.msurf"));
  made("morph " + (s / "ball.json") + " " + (s / "ball.json") + " --frames 2 --voxel 0.2 --vdb " + (s / "g.####.vdb") +
       " -o " + (s / "m.####.ply"));
  for (const std::string file : {"ball.json", "ball.ply", "points.msurf", "g.0001.vdb", "drops.csv"}) {
    const std::string before = "cat '" + (s / file) + "' |";
    const std::string radius = file == "drops.csv" ? " --radius 0.4" : "";
    for (const std::string& line : {std::string("info -"), "mesh - --voxel 0.2 -f -o " + (s / "x.ply") + radius,
                                    "sample - --count 100 -f -o " + (s / "y.ply") + radius,
                                    "render - --size 20x20 --samples 1 -f -o " + (s / "z.png")}) {
      const auto r = meniscus_program(line, before);
      EXPECT_EQ(r.code, 0) << file << ": " << line << "\n" << r.err;
    }
    EXPECT_EQ(meniscus_program("mesh " + (s / file) + " --voxel 0.2 -q -f -o " + (s / "w.obj") + radius).code, 0);
    EXPECT_EQ(meniscus_program("mesh - --voxel 0.2 -q -f -o " + (s / "x.obj") + radius, before).code, 0);
    const auto body = [](std::string text) { return text.substr(text.find("\nv ")); };
    EXPECT_TRUE(body(contents(s / "w.obj")) == body(contents(s / "x.obj"))) << file;
  }
}

TEST(CommandLine, WhatReadersLeaveOutIsToldByEveryVerb) {
  const Scratch s;
  write(s / "particles.csv", "x,y,z\n0,0,0\n0.5,0,0\n0,0.5,nan\n");
  write(s / "cloud.csv",
        "x,y,z,nx,ny,nz\n1,0,0,1,0,0\n-1,0,0,-1,0,0\n0,1,0,0,1,0\n0,-1,0,0,-1,0\n0,0,1,0,0,1\n0,0,-1,0,0,-1\n"
        "nan,1,1,1,0,0\n");
  const std::string particles = s / "particles.csv", cloud = s / "cloud.csv";
  for (const std::string& line :
       {"info " + particles, "mesh " + particles + " --radius 0.4 -o " + (s / "m.ply"),
        "sample " + particles + " --radius 0.4 --count 50 -o " + (s / "s.ply"),
        "morph " + particles + " " + kScenes + "ball.json --frames 2 --voxel 0.2 -o " + (s / "o.####.ply"),
        "convert " + particles + " -o " + (s / "c.ply"),
        "render " + particles + " --size 20x20 --samples 1 -o " + (s / "r.png"), "fit " + cloud + " -o " + (s / "f.msurf"),
        "boolean union " + cloud + " " + cloud + " -o " + (s / "b.msurf")}) {
    const auto r = meniscus_program(line + " --json");
    ASSERT_EQ(r.code, 0) << line << "\n" << r.err;
    std::size_t told = 0;
    const auto report = nlohmann::json::parse(r.out);
    for (const auto& w : report["warnings"]) told += w["code"] == "dropped-points";
    EXPECT_EQ(told, 1u) << line << "\n" << r.out;
  }
}

TEST(CommandLine, ParametersOfAScene) {
  const Scratch s;
  const auto volume = [&](const std::string& bore) {
    const auto r =
        meniscus_program("mesh " + kScenes + "csg_part.json --set bore=" + bore + " --json --force -o " + (s / "p.ply"));
    EXPECT_EQ(r.code, 0) << r.err;
    return nlohmann::json::parse(r.out)["mesh"]["volume"].get<double>();
  };
  EXPECT_GT(volume("0.1"), volume("0.3"));
  const auto wrong = meniscus_program("mesh " + kScenes + "csg_part.json --set bor=0.2 -o " + (s / "q.ply"));
  EXPECT_EQ(wrong.code, 3);
  EXPECT_NE(wrong.err.find("did you mean 'bore'"), std::string::npos) << wrong.err;
  EXPECT_EQ(meniscus_program("mesh " + kScenes + "csg_part.json --set bore=9 -o " + (s / "q.ply")).code, 3);
}

TEST(CommandLine, MovingScenesGiveSequences) {
  const Scratch s;
  const auto r = meniscus_program("mesh " + kScenes + "two_blobs.json --frames 1-9x4 --voxel 0.1 -o " + (s / "b.####.ply"));
  ASSERT_EQ(r.code, 0) << r.err;
  for (const char* f : {"b.0001.ply", "b.0005.ply", "b.0009.ply"}) EXPECT_TRUE(std::filesystem::exists(s / f)) << f;
  EXPECT_EQ(meniscus_program("check '" + (s / "b.####.ply") + "'").code, 0);
  EXPECT_EQ(meniscus_program("mesh " + kScenes + "two_blobs.json --frames 1-9 -o " + (s / "one.ply")).code, 2);
}

TEST(CommandLine, ShippedParticlesBecomeAMeshAndAPicture) {
  const Scratch s;
  const std::string drops = MENISCUS_SOURCE_DIR "/examples/data/drops.lammpstrj.gz";
  const auto made = meniscus_program("mesh " + drops + " --frames 8 --radius 0.8 --voxel 0.4 -o " + (s / "d.ply"));
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(meniscus_program("check " + (s / "d.ply")).code, 0);
  const auto drawn = meniscus_program("render " + (s / "d.ply") + " --size 160x120 --samples 4 -o " + (s / "d.png"));
  ASSERT_EQ(drawn.code, 0) << drawn.err;
  EXPECT_EQ(contents(s / "d.png").substr(1, 3), "PNG");
}

TEST(CommandLine, ACancelledRunLeavesNothingBehind) {
  const Scratch s;
  const auto r = meniscus_program("mesh " + kScenes + "gyroid.json --voxel 0.002 -o " + (s / "big.ply"), "timeout -s INT 1");
  if (r.code == 0) GTEST_SKIP() << "finished before it could be interrupted";
  EXPECT_TRUE(std::filesystem::is_empty(std::filesystem::path(s / "x").parent_path()));
}

TEST(CommandLine, CompletionNamesEveryVerb) {
  for (const std::string shell : {"bash", "zsh", "fish"}) {
    const auto r = meniscus_program("completion " + shell);
    EXPECT_EQ(r.code, 0);
    for (const char* verb : {"mesh", "render", "convert"}) EXPECT_NE(r.out.find(verb), std::string::npos) << shell;
  }
  const Scratch s;
  write(s / "c.bash", meniscus_program("completion bash").out);
  EXPECT_EQ(std::system(("bash -n '" + (s / "c.bash") + "'").c_str()), 0);
}

}  // namespace
}  // namespace meniscus
