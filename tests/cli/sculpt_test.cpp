#include "support/program.h"

#include <meniscus/io/geometry.h>
#include <meniscus/io/msurf.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <filesystem>

namespace meniscus {
namespace {

using test::contents;
using test::meniscus_program;
using test::Scratch;

/// A sphere of floaters, as a user would get one.
std::string sphere_file(const Scratch& s) {
  std::ofstream(s / "sphere.json") << R"({"format":"meniscus.scene","version":1,
    "surface":{"type":"sphere","center":[0,0,0],"radius":1}})";
  const auto made = meniscus_program("sample " + (s / "sphere.json") + " --count 1500 -q -o " + (s / "sphere.ply"));
  EXPECT_EQ(made.code, 0) << made.err;
  return s / "sphere.ply";
}

std::string script_file(const Scratch& s, const std::string& strokes) {
  std::ofstream(s / "script.json") << R"({"strokes":[)" << strokes << "]}";
  return s / "script.json";
}

const std::string kPull = R"({"tool":"force","path":[0,0,1],"radius":0.5,"strength":0.2,"voxels":20,"steps":4})";

TEST(Sculpt, RunsAScriptAndReportsEveryStroke) {
  const Scratch s;
  const std::string cloud = sphere_file(s);
  const std::string script = script_file(s, kPull + R"(,{"tool":"smooth","path":[0,0,1],"radius":0.3,"strength":0.5})");
  const auto r = meniscus_program("sculpt " + cloud + " " + script + " --json -o " + (s / "out.ply"));
  ASSERT_EQ(r.code, 0) << r.err;
  const auto report = nlohmann::json::parse(r.out);
  ASSERT_EQ(report["strokes"].size(), 2u);
  EXPECT_GT(report["strokes"][0]["voxels"], 1000);
  EXPECT_EQ(report["strokes"][1]["voxels"], 0);
  EXPECT_EQ(report["points"], report["strokes"][1]["points"]);
  EXPECT_GT(report["outputs"][0]["bbox"][1][2], 1.1);
  EXPECT_LT(report["outputs"][0]["bbox"][1][1], 1.01);
}

TEST(Sculpt, WhatIsUndoneIsNotThere) {
  const Scratch s;
  const std::string cloud = sphere_file(s);
  const std::string touch = R"({"tool":"inflate","path":[0,0,-1],"radius":0.2,"strength":0.02})";
  const std::string a = script_file(s, touch);
  ASSERT_EQ(meniscus_program("sculpt " + cloud + " " + a + " -q -o " + (s / "a.ply")).code, 0);
  const std::string b = script_file(s, kPull + R"(,{"tool":"undo"},)" + touch);
  ASSERT_EQ(meniscus_program("sculpt " + cloud + " " + b + " -q -o " + (s / "b.ply")).code, 0);
  // The same but for the header, which holds the command line.
  const auto body = [](const std::string& file) { return file.substr(file.find("end_header")); };
  EXPECT_EQ(body(contents(s / "a.ply")), body(contents(s / "b.ply")));
}

// The points come from `sample` with radii; kept, they would make blobs of what was sculpted.
TEST(Sculpt, WhatIsSculptedIsASurfaceToOtherVerbs) {
  const Scratch s;
  const std::string script = script_file(s, kPull);
  ASSERT_EQ(meniscus_program("sculpt " + sphere_file(s) + " " + script + " -q -o " + (s / "out.ply")).code, 0);
  const auto r = meniscus_program("mesh " + (s / "out.ply") + " --voxel 0.05 --json -o " + (s / "out.obj"));
  ASSERT_EQ(r.code, 0) << r.err;
  const auto mesh = nlohmann::json::parse(r.out)["mesh"];
  EXPECT_EQ(mesh["components"], 1);
  EXPECT_EQ(mesh["closed"], true);
  EXPECT_GT(mesh["volume"], 4.18);
  EXPECT_LT(mesh["volume"], 4.6);
}

TEST(Sculpt, TakesAndGivesPointSetSurfaces) {
  const Scratch s;
  const std::string cloud = sphere_file(s), script = script_file(s, kPull);
  ASSERT_EQ(meniscus_program("fit " + cloud + " -q -o " + (s / "sphere.msurf")).code, 0);
  ASSERT_EQ(meniscus_program("sculpt " + cloud + " " + script + " -q -o " + (s / "a.ply")).code, 0);
  ASSERT_EQ(meniscus_program("sculpt " + (s / "sphere.msurf") + " " + script + " -q -o " + (s / "b.msurf")).code, 0);
  const std::vector<Vec3> a = io::read_cloud(s / "a.ply").positions;  // in single precision
  const pointset::PointSet b = io::read_msurf(s / "b.msurf").set;
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_LT((a[i] - b.position(i)).norm(), 1e-5);
  const auto again = meniscus_program("sculpt " + (s / "b.msurf") + " " + script + " -q -o " + (s / "c.ply"));
  EXPECT_EQ(again.code, 0) << again.err;
}

TEST(Sculpt, WritesTheMotion) {
  const Scratch s;
  const auto r = meniscus_program("sculpt " + sphere_file(s) + " " + script_file(s, kPull) +
                                  " --frames 1-3x2,99 --json -o " + (s / "out.ply"));
  ASSERT_EQ(r.code, 0) << r.err;
  EXPECT_TRUE(std::filesystem::exists(s / "out.0001.ply"));
  EXPECT_FALSE(std::filesystem::exists(s / "out.0002.ply"));
  EXPECT_TRUE(std::filesystem::exists(s / "out.0003.ply"));
  const auto report = nlohmann::json::parse(r.out);
  EXPECT_EQ(report["outputs"].size(), 3u);
  EXPECT_EQ(report["warnings"][0]["code"], "frames");
}

TEST(Sculpt, BadInputIsNamed) {
  const Scratch s;
  const std::string cloud = sphere_file(s), script = script_file(s, kPull);
  const std::string out = " -o " + (s / "out.ply");
  EXPECT_EQ(meniscus_program("sculpt " + cloud + out).code, 2);
  EXPECT_EQ(meniscus_program("sculpt " + (s / "none.ply") + " " + script + out).code, 3);
  EXPECT_EQ(meniscus_program("sculpt " + cloud + " " + (s / "none.json") + out).code, 3);
  std::ofstream(s / "line.xyz") << "0 0 0\n1 0 0\n2 0 0\n3 0 0\n";
  const auto line = meniscus_program("sculpt " + (s / "line.xyz") + " " + script + out);
  EXPECT_EQ(line.code, 3);
  EXPECT_NE(line.err.find("line"), std::string::npos) << line.err;
  const std::string emboss = script_file(s, R"({"tool":"emboss","image":"none.png","strength":0.1})");
  const auto image = meniscus_program("sculpt " + cloud + " " + emboss + out);
  EXPECT_EQ(image.code, 3);
  EXPECT_NE(image.err.find("none.png"), std::string::npos) << image.err;
  EXPECT_FALSE(std::filesystem::exists(s / "out.ply"));
  ASSERT_EQ(meniscus_program("sculpt " + cloud + " " + script_file(s, kPull) + " -q" + out).code, 0);
  EXPECT_EQ(meniscus_program("sculpt " + cloud + " " + script + " -q" + out).code, 4);
}

TEST(Sculpt, SchemaIsPublished) {
  const auto r = meniscus_program("schema sculpt");
  ASSERT_EQ(r.code, 0);
  EXPECT_EQ(nlohmann::json::parse(r.out)["title"], "meniscus sculpt script");
  EXPECT_EQ(nlohmann::json::parse(meniscus_program("schema").out)["title"], "meniscus scene");
}

}  // namespace
}  // namespace meniscus
