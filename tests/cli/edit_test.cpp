#include "support/program.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace meniscus {
namespace {

using test::contents;
using test::meniscus_program;
using test::Scratch;

const char* kTwoBalls = R"({"format":"meniscus.scene","version":1,"extras":{"note":"kept"},
  "params":{"r":{"value":1,"min":0.5,"max":2}},
  "surface":{"type":"union","inputs":[
    {"type":"sphere","center":[0,0,0],"radius":{"param":"r"},"freeze":["center"]},
    {"type":"sphere","id":"second","center":[5,0,0],"radius":0.5}]}})";

nlohmann::json json_of(const std::string& path) { return nlohmann::json::parse(contents(path)); }

std::string scene_file(const Scratch& s, const std::string& text) {
  std::ofstream(s / "scene.json", std::ios::binary) << text;
  return s / "scene.json";
}

TEST(Edit, DragsWriteValuesBackIntoTheScene) {
  const Scratch s;
  const std::string scene = scene_file(s, kTwoBalls), out = s / "out.json";
  const auto r = meniscus_program("edit " + scene + " --drag '0,1,0 -> 0,1.25,0' --json -o " + out);
  ASSERT_EQ(r.code, 0) << r.err;
  const auto scene_out = json_of(out), report = nlohmann::json::parse(r.out);
  EXPECT_NEAR(scene_out["params"]["r"]["value"].get<double>(), 1.25, 1e-9);
  EXPECT_EQ(scene_out["surface"]["inputs"][1], json_of(scene)["surface"]["inputs"][1]) << "out of reach";
  EXPECT_EQ(scene_out["extras"]["note"], "kept");
  EXPECT_EQ(report["control"]["count"], 1);
  EXPECT_EQ(report["control"]["rank"], 1);
  EXPECT_EQ(report["control"]["status"], "solved");
  EXPECT_NEAR(report["values"]["r"].get<double>(), 1.25, 1e-9);
  EXPECT_EQ(meniscus_program("info " + out).code, 0);
}

TEST(Edit, SidewaysDragsMoveThePart) {
  const Scratch s;
  const std::string scene = scene_file(s, kTwoBalls), out = s / "out.json";
  ASSERT_EQ(meniscus_program("edit " + scene + " --sideways --drag '5,0.5,0 -> 5,0.5,2' -o " + out).code, 0);
  const auto ball = json_of(out)["surface"]["inputs"][1];
  EXPECT_NEAR(ball["center"][2].get<double>(), 2, 1e-9);
  EXPECT_NEAR(ball["radius"].get<double>(), 0.5, 1e-9);
}

TEST(Edit, ScriptsOfStrokesThereAndBackEndWhereTheyBegan) {
  const Scratch s;
  const std::string scene = scene_file(s, kTwoBalls), out = s / "out.json";
  std::ofstream(s / "strokes.json") << R"({"strokes":[
    {"label":"up","drags":[{"path":[[5,0.5,0],[5,1,0],[5,0.8,0.3],[5,0.5,0]]}],"pins":[[0,1,0]]},
    {"drags":[{"path":[[0,1,0],[0,1.5,0]]}]}]})";
  const auto r = meniscus_program("edit " + scene + " --script " + (s / "strokes.json") + " -o " + out);
  ASSERT_EQ(r.code, 0) << r.err;
  const auto surface = json_of(out)["surface"]["inputs"][1];
  EXPECT_NEAR(surface["center"][1].get<double>(), 0, 1e-9);
  EXPECT_NEAR(surface["radius"].get<double>(), 0.5, 1e-9);
  EXPECT_NEAR(json_of(out)["params"]["r"]["value"].get<double>(), 1.5, 1e-9);
}

TEST(Edit, TheMotionIsWrittenFrameByFrame) {
  const Scratch s;
  const std::string scene = scene_file(s, kTwoBalls), out = s / "out.json", plain = s / "plain.json";
  std::ofstream(s / "strokes.json") << R"({"strokes":[
    {"seconds":0.5,"drags":[{"path":[[5,0.5,0],[5,0.5,0.4]],"sideways":true}]},
    {"drags":[{"path":[[0,1,0],[0,1.4,0],[0,1.2,0]],"times":[0,0.25,0.5]}]}]})";
  const std::string edit = "edit " + scene + " --script " + (s / "strokes.json");
  const auto r = meniscus_program(edit + " --fps 8 --frames " + (s / "m.####.json") + " --points " + (s / "p.####.ply") +
                                  " --count 300 --json -o " + out);
  ASSERT_EQ(r.code, 0) << r.err;
  ASSERT_EQ(meniscus_program(edit + " -o " + plain).code, 0);
  EXPECT_EQ(nlohmann::json::parse(r.out)["outputs"].size(), 2 * 9u + 1);
  // Each frame's scene is where the drag is then; the last is the result, and that of the strokes made at once.
  const auto frame = [&](int k) { return json_of(s / ("m.000" + std::to_string(k) + ".json")); };
  EXPECT_EQ(frame(1), json_of(scene));
  for (int k = 1; k <= 4; ++k) EXPECT_NEAR(frame(1 + k)["surface"]["inputs"][1]["center"][2].get<double>(), 0.1 * k, 1e-9);
  EXPECT_NEAR(frame(6)["params"]["r"]["value"].get<double>(), 1.2, 1e-9);
  EXPECT_NEAR(frame(7)["params"]["r"]["value"].get<double>(), 1.4, 1e-9);
  EXPECT_EQ(frame(9), json_of(out));
  EXPECT_NEAR(frame(9)["params"]["r"]["value"].get<double>(), json_of(plain)["params"]["r"]["value"].get<double>(), 1e-9);
  const auto points = meniscus_program("info " + (s / "p.0009.ply") + " --json");
  EXPECT_EQ(points.code, 0);
  // Meshes, and floaters at the end alone.
  const auto meshes = meniscus_program(edit + " --fps 4 --voxel 0.2 --frames " + (s / "m.####.ply") + " --points " +
                                       (s / "p.ply") + " --count 200 -f -o " + out);
  ASSERT_EQ(meshes.code, 0) << meshes.err;
  EXPECT_EQ(meniscus_program("check " + (s / "m.####.ply")).code, 0);
  EXPECT_TRUE(std::ifstream(s / "m.0005.ply").good());
  EXPECT_FALSE(std::ifstream(s / "m.0006.ply").good());
  EXPECT_TRUE(std::ifstream(s / "p.ply").good());
  EXPECT_EQ(meniscus_program(edit + " --frames m.ply -f -o " + out).code, 2);
}

TEST(Edit, AVolumeOrAnAreaIsReached) {
  const Scratch s;
  const std::string scene =
      scene_file(s, R"({"format":"meniscus.scene","version":1,"surface":{"type":"sphere","center":[1,2,3],"radius":1}})");
  const std::string out = s / "out.json";
  const auto r = meniscus_program("edit " + scene + " --volume 33.510321638 --json -o " + out);
  ASSERT_EQ(r.code, 0) << r.err;
  EXPECT_NEAR(json_of(out)["surface"]["radius"].get<double>(), 2, 2e-3);
  EXPECT_TRUE(nlohmann::json::parse(r.out)["goal"]["reached"]);
  ASSERT_EQ(meniscus_program("edit " + scene + " --area 3.14159265 -f -o " + out).code, 0);
  EXPECT_NEAR(json_of(out)["surface"]["radius"].get<double>(), 0.5, 1e-3);
  const auto frozen = meniscus_program("edit " + scene + " --area 3 --freeze radius -f -o " + out);
  EXPECT_NE(frozen.err.find("no shape near by"), std::string::npos) << frozen.err;
  EXPECT_EQ(meniscus_program("edit " + scene + " --area 0 -f -o " + out).code, 2);
}

TEST(Edit, MistakesAreExplainedAndWriteNothing) {
  const Scratch s;
  const std::string scene = scene_file(s, kTwoBalls), out = s / "out.json", to = " -o " + out;
  EXPECT_EQ(meniscus_program("edit " + scene + to).code, 2);
  EXPECT_EQ(meniscus_program("edit " + scene + " --drag '0,1,0'" + to).code, 2);
  EXPECT_EQ(meniscus_program("edit " + scene + " --drag '0,1,0 -> 0,nan,0'" + to).code, 2);
  const auto off = meniscus_program("edit " + scene + " --drag '0,3,0 -> 0,4,0'" + to);
  EXPECT_EQ(off.code, 3);
  EXPECT_NE(off.err.find("surface"), std::string::npos);
  const auto freeze = meniscus_program("edit " + scene + " --drag '5,0.5,0 -> 5,1,0' --freeze input[1]" + to);
  EXPECT_EQ(freeze.code, 3);
  EXPECT_NE(freeze.err.find("input[1]"), std::string::npos) << freeze.err;
  const auto none = meniscus_program("edit " + scene + " --drag '5,0.5,0 -> 5,1,0' --freeze 'inputs[1]'" + to);
  EXPECT_EQ(none.code, 1);
  EXPECT_NE(none.err.find("no parameter"), std::string::npos) << none.err;
  EXPECT_FALSE(std::ifstream(out).good());
}

TEST(Edit, ContradictionsAreWarnedOf) {
  const Scratch s;
  const std::string scene = scene_file(s, kTwoBalls), out = s / "out.json";
  const auto r = meniscus_program("edit " + scene + " --drag '0,1,0 -> 0,1.2,0' --pin 0,0,1 -o " + out);
  EXPECT_EQ(r.code, 0);
  EXPECT_NE(r.err.find("misses the control"), std::string::npos) << r.err;
  EXPECT_NEAR(json_of(out)["params"]["r"]["value"].get<double>(), 1.1, 1e-9);
}

}  // namespace
}  // namespace meniscus
