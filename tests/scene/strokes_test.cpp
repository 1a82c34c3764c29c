#include "support/scratch.h"

#include <meniscus/base/error.h>
#include <meniscus/scene/strokes.h>

#include <gtest/gtest.h>

#include <fstream>

namespace meniscus::scene {
namespace {

std::vector<Stroke> read(const std::string& text) {
  const test::Scratch s;
  std::ofstream(s / "strokes.json", std::ios::binary) << text;
  return read_strokes(s / "strokes.json");
}

TEST(Strokes, PathsAreWalkedByTheirTimes) {
  const auto strokes = read(R"({"strokes":[
    {"label":"up","seconds":3,"drags":[
       {"path":[[0,0,0],[2,0,0],[2,1,0]],"times":[0,0.5,2],"sideways":true},
       {"path":[[0,0,0],[0,0,4]]}],"pins":[[1,1,1]],"freeze":["items[0]"]},  // comments are allowed
    {"drags":[{"path":[[0,0,0],[0,0,4],[0,0,0]]}]}]})");
  ASSERT_EQ(strokes.size(), 2u);
  const Stroke& up = strokes[0];
  EXPECT_EQ(up.label, "up");
  EXPECT_EQ(up.freeze, std::vector<std::string>{"items[0]"});
  EXPECT_EQ(up.pins, std::vector<Vec3>{Vec3(1, 1, 1)});
  EXPECT_TRUE(up.drags[0].sideways);
  EXPECT_EQ(up.seconds(), 3);
  EXPECT_EQ(up.knots(), (std::vector<double>{0.5, 2, 3}));
  EXPECT_EQ(up.drags[0].at(0), Vec3(0, 0, 0));
  EXPECT_EQ(up.drags[0].at(0.25), Vec3(1, 0, 0));
  EXPECT_EQ(up.drags[0].at(0.5), Vec3(2, 0, 0));
  EXPECT_EQ(up.drags[0].at(1.25), Vec3(2, 0.5, 0));
  EXPECT_EQ(up.drags[0].at(9), Vec3(2, 1, 0));
  EXPECT_EQ(up.drags[1].at(1.5), Vec3(0, 0, 2));
  EXPECT_EQ(strokes[1].label, "drag");
  EXPECT_EQ(strokes[1].seconds(), 1);
  EXPECT_EQ(strokes[1].knots(), (std::vector<double>{0.5, 1}));
}

TEST(Strokes, MistakesNameTheirPlace) {
  const auto expect = [](const std::string& text, const std::string& place) {
    try {
      read(text);
      ADD_FAILURE() << text;
    } catch (const IoError& e) {
      EXPECT_NE(std::string(e.what()).find(place), std::string::npos) << e.what();
    }
  };
  expect("{", "JSON");
  expect(R"({"strokes":[]})", "strokes");
  expect(R"({"stroke":[]})", "stroke");
  expect(R"({"strokes":[{"drags":[{"path":[[0,0,0]]}]}]})", "strokes[0].drags[0].path");
  expect(R"({"strokes":[{"drags":[{"path":[[0,0,0],[1,0]]}]}]})", "path[1]");
  expect(R"({"strokes":[{"drags":[{"path":[[0,0,0],[1,0,0]],"times":[0]}]}]})", "times");
  expect(R"({"strokes":[{"drags":[{"path":[[0,0,0],[1,0,0]],"times":[0,0]}]}]})", "times[1]");
  expect(R"({"strokes":[{"drags":[{"path":[[0,0,0],[1,0,0]],"times":[1,2]}]}]})", "times[0]");
  expect(R"({"strokes":[{"seconds":0,"drags":[{"path":[[0,0,0],[1,0,0]]}]}]})", "seconds");
  expect(R"({"strokes":[{"drags":[{"path":[[0,0,0],[1e999,0,0]]}]}]})", "JSON");
  expect(R"({"strokes":[{"drags":[{"path":[[0,0,0],[1,0,0]],"sidewards":true}]}]})", "sidewards");
}

}  // namespace
}  // namespace meniscus::scene
