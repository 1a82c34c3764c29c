#include "samples.h"

#include <meniscus/base/error.h>
#include <meniscus/io/sequence.h>

#include <gtest/gtest.h>

namespace meniscus::io {
namespace {

/// Writes frames whose only point tells the frame.
void put_frames(const TemporaryFolder& folder, const std::vector<long>& frames) {
  for (const long f : frames) {
    points::Cloud cloud;
    cloud.positions = {Vec3(static_cast<double>(f), 0, 0)};
    write_cloud(FramePattern::parse(folder / "s.####.ply")->path(f), cloud);
  }
}

SequenceOptions with(Missing missing, std::optional<std::vector<long>> frames = {}) {
  SequenceOptions options;
  options.missing = missing;
  options.frames = std::move(frames);
  return options;
}

TEST(ParticleSequence, ReadsWhatAPatternFinds) {
  const TemporaryFolder folder;
  put_frames(folder, {8, 9, 10, 11});
  const ParticleSequence all({folder / "s.####.ply"});
  EXPECT_EQ(all.frames(), (std::vector<long>{8, 9, 10, 11}));
  EXPECT_EQ(all.read(10).positions.at(0).x(), 10);
  EXPECT_THROW(all.read(12), InvalidInput);
  const ParticleSequence some({folder / "s.####.ply"}, with(Missing::Error, parse_frames("9-10")));
  EXPECT_EQ(some.frames(), (std::vector<long>{9, 10}));
  EXPECT_THROW(ParticleSequence({folder / "none.####.ply"}), IoError);
  EXPECT_THROW(ParticleSequence(std::vector<std::string>{}), InvalidInput);
}

TEST(ParticleSequence, GapsFollowThePolicy) {
  const TemporaryFolder folder;
  put_frames(folder, {1, 2, 4, 5});
  const std::string pattern = folder / "s.####.ply";
  EXPECT_THROW(ParticleSequence({pattern}), IoError);
  EXPECT_EQ(ParticleSequence({pattern}, with(Missing::Skip)).frames(), (std::vector<long>{1, 2, 4, 5}));
  const ParticleSequence hold({pattern}, with(Missing::Hold));
  EXPECT_EQ(hold.frames(), (std::vector<long>{1, 2, 3, 4, 5}));
  EXPECT_EQ(hold.held(), (std::vector<long>{3}));
  EXPECT_EQ(hold.read(3).positions.at(0).x(), 2);
  EXPECT_EQ(hold.read(4).positions.at(0).x(), 4);
  const ParticleSequence longer({pattern}, with(Missing::Hold, parse_frames("4-7")));
  EXPECT_EQ(longer.read(7).positions.at(0).x(), 5);
  EXPECT_THROW(ParticleSequence({pattern}, with(Missing::Hold, parse_frames("0-3"))), IoError);
  EXPECT_THROW(ParticleSequence({pattern}, with(Missing::Skip, parse_frames("20-30"))), IoError);
}

TEST(ParticleSequence, EverySecondFrameIsNoGap) {
  const TemporaryFolder folder;
  put_frames(folder, {10, 20, 30});
  EXPECT_EQ(ParticleSequence({folder / "s.####.ply"}).frames(), (std::vector<long>{10, 20, 30}));
  put_frames(folder, {35});
  EXPECT_THROW(ParticleSequence({folder / "s.####.ply"}), IoError);
}

TEST(ParticleSequence, SeveralFiles) {
  const TemporaryFolder folder;
  put_frames(folder, {9, 10});
  const ParticleSequence s({folder / "s.0010.ply", folder / "s.0009.ply"});
  EXPECT_EQ(s.frames(), (std::vector<long>{9, 10}));
  EXPECT_EQ(s.read(9).positions.at(0).x(), 9);
  EXPECT_EQ(ParticleSequence({folder / "s.0010.ply"}).frames(), (std::vector<long>{1}));
}

TEST(ParticleSequence, DumpsHoldTheirSteps) {
  const TemporaryFolder folder;
  put_file(folder / "a.lammpstrj", lammps());
  put_file(folder / "bom.lammpstrj", "\xEF\xBB\xBF" + lammps());
  put_file(folder / "z.lammpstrj.gz", gzipped(lammps()));
  for (const char* name : {"a.lammpstrj", "bom.lammpstrj", "z.lammpstrj.gz"}) {
    const ParticleSequence s({folder / name});
    EXPECT_EQ(s.frames(), (std::vector<long>{1, 2})) << name;
    EXPECT_EQ(s.read(1).size(), 2u) << name;
    EXPECT_EQ(s.read(2).positions.at(0), Vec3(5, 10, 0)) << name;
  }
  put_file(folder / "b.lammpstrj", "x");
  EXPECT_THROW(ParticleSequence({folder / "b.lammpstrj"}), IoError);
}

TEST(ParticleSequence, FaultsInAFrameAreErrorsOfThatFrame) {
  const TemporaryFolder folder;
  put_frames(folder, {1, 2, 3});
  put_file(folder / "s.0002.ply", "ply\n");
  const ParticleSequence s({folder / "s.####.ply"});
  EXPECT_EQ(s.read(1).size(), 1u);
  EXPECT_THROW(s.read(2), IoError);
  EXPECT_EQ(s.read(3).size(), 1u);
}

TEST(ParticleSequence, LargeDumpsAreCutWhereStepsStart) {
  // Longer than the pieces the scan reads, so some steps straddle their borders.
  const TemporaryFolder folder;
  std::string dump;
  std::vector<std::size_t> sizes;
  for (std::size_t step = 0; dump.size() < (9u << 20); ++step) {
    const std::size_t atoms = 1 + step * 37 % 1000;
    sizes.push_back(atoms);
    dump += "ITEM: TIMESTEP\n" + std::to_string(step) + "\nITEM: NUMBER OF ATOMS\n" + std::to_string(atoms) +
            "\nITEM: BOX BOUNDS pp pp pp\n0 1\n0 1\n0 1\nITEM: ATOMS id x y z\n";
    for (std::size_t i = 0; i < atoms; ++i) dump += std::to_string(i) + " " + std::to_string(step) + " 0 0.5\n";
  }
  put_file(folder / "a.dump", dump);
  const ParticleSequence s({folder / "a.dump"});
  ASSERT_EQ(s.frames().size(), sizes.size());
  for (const long f : s.frames()) {
    const points::Cloud cloud = s.read(f);
    ASSERT_EQ(cloud.size(), sizes[static_cast<std::size_t>(f - 1)]) << f;
    ASSERT_EQ(cloud.positions.back().x(), static_cast<double>(f - 1));
  }
}

TEST(NoteChanges, TellsAttributesAndIdentities) {
  points::Cloud a, b;
  a.positions = b.positions = {Vec3::Zero(), Vec3::Ones()};
  a.attributes.set("v", 3, std::vector<double>(6));
  b.attributes.set("density", 1, {1, 2});
  b.attributes.set_integers("id", 1, {4, 4});
  ReadReport report;
  note_changes(a, b, "f.ply", report);
  ASSERT_EQ(report.warnings.size(), 3u);
  EXPECT_EQ(report.warnings[0].code, "attribute-vanished");
  EXPECT_EQ(report.warnings[1].code, "attribute-appeared");
  EXPECT_EQ(report.warnings[2].code, "duplicate-ids");
}

}  // namespace
}  // namespace meniscus::io
