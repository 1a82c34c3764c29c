#include "support.h"

#include <meniscus/base/error.h>
#include <meniscus/io/manifest.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace meniscus::io {
namespace {

TEST(Fingerprint, ChangesWithEveryByteAndTheLength) {
  EXPECT_EQ(fingerprint("abc"), fingerprint("abc"));
  EXPECT_EQ(fingerprint("").size(), 32u);
  std::string text(100, 'a');
  std::vector<std::string> seen = {fingerprint(text), fingerprint(text + '\0'), fingerprint(text.substr(1)),
                                   fingerprint("")};
  for (char& c : text) {
    c ^= 1;
    seen.push_back(fingerprint(text));
    c ^= 1;
  }
  std::sort(seen.begin(), seen.end());
  EXPECT_EQ(std::adjacent_find(seen.begin(), seen.end()), seen.end());
}

TEST(ManifestPath, StandsBesideTheFrames) {
  EXPECT_EQ(manifest_path("out/skin.####.ply"), "out/skin.manifest.json");
  EXPECT_EQ(manifest_path("skin_%04d.ply"), "skin.manifest.json");
  EXPECT_EQ(manifest_path("skin.$F4.ply"), "skin.manifest.json");
  EXPECT_EQ(manifest_path("a/{}.ply"), "a/frames.manifest.json");
  EXPECT_EQ(manifest_path("a.b/mesh.ply"), "a.b/mesh.manifest.json");
}

TEST(Manifest, ResumesWhatIsWholeAndTheSame) {
  const TemporaryFolder folder;
  const std::string path = folder / "s.manifest.json";
  for (const char* n : {"s.1.ply", "s.2.ply", "s.3.ply"}) put_file(folder / n, n);
  Manifest first(path, "voxel 0.1");
  EXPECT_EQ(first.resume(), 0u);
  for (long f = 1; f <= 3; ++f) first.add(f, folder / ("s." + std::to_string(f) + ".ply"));
  Manifest second(path, "voxel 0.1");
  EXPECT_EQ(second.resume(), 3u);
  EXPECT_TRUE(second.has(2));
  EXPECT_FALSE(second.has(4));

  put_file(folder / "s.2.ply", "damaged");
  std::filesystem::remove(folder / "s.3.ply");
  EXPECT_EQ(second.resume(), 1u);
  EXPECT_TRUE(second.has(1));
  EXPECT_EQ(Manifest(path, "voxel 0.2").resume(), 0u);
  EXPECT_THROW(second.add(9, folder / "none.ply"), IoError);
}

TEST(Manifest, WhatStandsBesideAFrameSurvivesAResume) {
  const TemporaryFolder folder;
  const std::string path = folder / "s.manifest.json";
  for (const char* n : {"s.1.ply", "s.2.ply"}) put_file(folder / n, n);
  Manifest(path, "x").add(1, folder / "s.1.ply", {}, {{"remeshed", "topology"}, {"carried", 7}});
  Manifest second(path, "x");
  ASSERT_EQ(second.resume(), 1u);
  second.add(2, folder / "s.2.ply");
  const auto frames = nlohmann::json::parse(file_content(path))["frames"];
  EXPECT_EQ(frames[0]["remeshed"], "topology");
  EXPECT_EQ(frames[0]["carried"], 7);
  EXPECT_EQ(frames[0]["file"], "s.1.ply");
  EXPECT_EQ(frames[1].size(), 3u);
}

TEST(Manifest, BrokenOnesGiveNothing) {
  const TemporaryFolder folder;
  const std::string path = folder / "s.manifest.json";
  put_file(folder / "a.ply", "a");
  Manifest(path, "x").add(1, folder / "a.ply");
  const std::string good = file_content(path);
  ASSERT_EQ(Manifest(path, "x").resume(), 1u);
  for (std::size_t n = 0; n + 2 < good.size(); ++n) {
    put_file(path, good.substr(0, n));
    ASSERT_EQ(Manifest(path, "x").resume(), 0u) << n;
  }
  for (std::size_t i = 0; i < good.size(); ++i)
    for (const char c : {'\xff', '"'}) {
      std::string bytes = good;
      bytes[i] = c;
      put_file(path, bytes);
      ASSERT_LE(Manifest(path, "x").resume(), 1u) << i;
    }
}

}  // namespace
}  // namespace meniscus::io
