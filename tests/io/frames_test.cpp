#include "support.h"

#include <meniscus/base/error.h>
#include <meniscus/io/frames.h>

#include <gtest/gtest.h>

namespace meniscus::io {
namespace {

TEST(ParseFrames, Grammar) {
  EXPECT_EQ(parse_frames("7"), (std::vector<long>{7}));
  EXPECT_EQ(parse_frames("1-4"), (std::vector<long>{1, 2, 3, 4}));
  EXPECT_EQ(parse_frames("1-10x4"), (std::vector<long>{1, 5, 9}));
  EXPECT_EQ(parse_frames("12-14,5,9,13"), (std::vector<long>{5, 9, 12, 13, 14}));
  for (const char* bad :
       {"", ",", "1-", "-3", "4-1", "1-5x0", "1-5x", "a", "1,,2", "1.5", "1-5y2", "99999999999", "0-999999999"})
    EXPECT_THROW(parse_frames(bad), InvalidInput) << bad;
}

TEST(FramePattern, WritesNumbers) {
  EXPECT_EQ(FramePattern::parse("a/s.####.ply")->path(7), "a/s.0007.ply");
  EXPECT_EQ(FramePattern::parse("s.####.ply")->path(12345), "s.12345.ply");
  EXPECT_EQ(FramePattern::parse("s%04d.ply")->path(7), "s0007.ply");
  EXPECT_EQ(FramePattern::parse("s.$F4.ply")->path(7), "s.0007.ply");
  EXPECT_EQ(FramePattern::parse("s.$F.ply")->path(7), "s.7.ply");
  EXPECT_EQ(FramePattern::parse("s_{}.ply")->path(7), "s_7.ply");
  EXPECT_EQ(FramePattern::parse("s_%d.ply")->path(7), "s_7.ply");
  EXPECT_FALSE(FramePattern::parse("plain.ply"));
  EXPECT_FALSE(FramePattern::parse("100%.ply"));
  EXPECT_THROW(FramePattern::parse("a.##.##.ply"), InvalidInput);
  EXPECT_THROW(FramePattern::parse("a##/b.ply"), InvalidInput);
}

TEST(FramePattern, FindsFiles) {
  const TemporaryFolder folder;
  for (const char* name : {"s.2.ply", "s.10.ply", "s.0003.ply", "s..ply", "s.x.ply", "s.4.obj", "t.5.ply"})
    put_file(folder / name, "");
  const auto files = FramePattern::parse(folder / "s.{}.ply")->existing();
  ASSERT_EQ(files.size(), 3u);
  EXPECT_EQ(files[0].frame, 2);
  EXPECT_EQ(files[1].path, folder / "s.0003.ply");
  EXPECT_EQ(files[2].frame, 10);
  EXPECT_EQ(FramePattern::parse(folder / "s.####.ply")->existing().size(), 1u);
  put_file(folder / "s.02.ply", "");
  EXPECT_THROW(FramePattern::parse(folder / "s.{}.ply")->existing(), InvalidInput);
}

TEST(NumberFiles, TakesTheNumberThatCounts) {
  const auto files = number_files({"run2_f10_v1.ply", "run2_f9_v1.ply"});
  EXPECT_EQ(files[0].frame, 9);
  EXPECT_EQ(files[1].path, "run2_f10_v1.ply");
  const auto mixed = number_files({"b5.ply", "a1.ply"});
  EXPECT_EQ(mixed[0].path, "b5.ply");
  EXPECT_EQ(mixed[1].frame, 2);
  EXPECT_THROW(number_files({"f1.ply", "f01.ply"}), InvalidInput);
  EXPECT_EQ(number_files({"f7.ply"})[0].frame, 1);
}

}  // namespace
}  // namespace meniscus::io
