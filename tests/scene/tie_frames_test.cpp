#include "support/program.h"

#include <meniscus/base/error.h>
#include <meniscus/scene/tie_frames.h>

#include <gtest/gtest.h>

#include <filesystem>

namespace meniscus::scene {
namespace {

using test::contents;
using test::Scratch;

TEST(TieFrames, StemsAreWhatNamesHaveInCommon) {
  EXPECT_EQ(sequence_stem("out/skin.####.ply"), "out/skin");
  EXPECT_EQ(sequence_stem("skin_%04d.vtp"), "skin");
  EXPECT_EQ(sequence_stem("a.b/s.$F4.usda"), "a.b/s");
}

TEST(TieFrames, ParaViewsCollectionTellsSeconds) {
  const Scratch s;
  tie_frames(s / "t.####.vtp", {1, 7, 13}, 6, {});
  const std::string pvd = contents(s / "t.pvd");
  const auto at = [&](const char* part) { return pvd.find(part); };
  ASSERT_NE(at("t.0001.vtp"), std::string::npos);
  EXPECT_LT(at("t.0001.vtp"), at("t.0007.vtp"));
  EXPECT_LT(at("t.0007.vtp"), at("t.0013.vtp"));
  EXPECT_EQ(at(std::filesystem::path(s / "x").parent_path().c_str()), std::string::npos) << "paths are beside the file";
  // Frame 1 is at a sixth of a second, 7 and 13 a second apart.
  for (const char* time : {"timestep=\"0.1666", "timestep=\"1.1666", "timestep=\"2.1666"})
    EXPECT_NE(at(time), std::string::npos) << time << '\n' << pvd;
}

TEST(TieFrames, AStageShowsFramesByTheirNumbers) {
  const Scratch s;
  tie_frames(s / "t.####.usda", {3, 4}, 24, {});
  const std::string stage = contents(s / "t.usda");
  EXPECT_NE(stage.find("t.0003.usda"), std::string::npos);
  EXPECT_NE(stage.find("t.0004.usda"), std::string::npos);
  EXPECT_NE(stage.find("startTimeCode = 3"), std::string::npos) << stage;
}

TEST(TieFrames, OtherFormatsNeedNone) {
  const Scratch s;
  tie_frames(s / "t.####.ply", {1, 2}, 24, {});
  EXPECT_TRUE(std::filesystem::is_empty(std::filesystem::path(s / "x").parent_path()));
}

TEST(TieFrames, ReplacesAnOldOneAndRefusesANameWithoutPlace) {
  const Scratch s;
  tie_frames(s / "t.####.vtp", {1}, 24, {});
  tie_frames(s / "t.####.vtp", {1, 2}, 24, {});
  EXPECT_NE(contents(s / "t.pvd").find("t.0002.vtp"), std::string::npos);
  EXPECT_THROW(tie_frames(s / "t.vtp", {1}, 24, {}), InvalidInput);
  EXPECT_THROW(tie_frames(s / "no/such/t.####.vtp", {1}, 24, {}), IoError);
}

}  // namespace
}  // namespace meniscus::scene
