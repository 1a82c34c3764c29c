#include "support/program.h"

#include <meniscus/base/error.h>
#include <meniscus/scene/track_job.h>

#include <gtest/gtest.h>

#include <filesystem>
#include <set>

namespace meniscus::scene {
namespace {

using test::contents;
using test::Scratch;

struct Killed {};

/// Frames 6 to 16 of two blobs, which meet in frame 11 or so; "killed" once a frame is done.
std::vector<TrackJobFrame> run(TrackJobOptions options, const std::string& to, bool resume, long killed_after = 0) {
  SourceOptions source;
  source.frames = io::parse_frames("6-16");
  options.track.voxel = 0.2;
  options.output.meshes = to;
  options.output.resume = resume;
  std::vector<TrackJobFrame> report;
  run_track_job(SurfaceSource({MENISCUS_SOURCE_DIR "/scenes/two_blobs.json"}, source), options, [&](const TrackJobFrame& f) {
    report.push_back(f);
    if (f.frame == killed_after) throw Killed();
  });
  return report;
}

std::set<std::string> names_in(const std::string& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) names.insert(entry.path().filename().string());
  return names;
}

TEST(TrackJob, ResumesToTheSameBytes) {
  TrackJobOptions mesh;
  mesh.track.tracker.velocity.kind = motion::Velocity::Isometric;
  mesh.track.tracker.fairing = 2;
  mesh.track.checker = 0.3;
  TrackJobOptions points;
  points.track.points = true;
  points.track.redistribution = 4;
  for (const TrackJobOptions& options : {mesh, points}) {
    for (const std::string extension : {"vtp", "usda"}) {
      const Scratch whole;
      run(options, whole / ("t.####." + extension), false);
      for (const long after : {6L, 12L}) {
        const Scratch halved;
        const std::string to = halved / ("t.####." + extension);
        EXPECT_THROW(run(options, to, false, after), Killed);
        const auto report = run(options, to, true);
        ASSERT_EQ(report.size(), 11u);
        for (const TrackJobFrame& f : report) EXPECT_EQ(f.kept, f.frame <= after) << f.frame;
        const auto names = names_in(whole / "");
        EXPECT_EQ(names_in(halved / ""), names);
        EXPECT_TRUE(names.contains(extension == "vtp" ? "t.pvd" : "t.usda"));
        for (const std::string& name : names) EXPECT_EQ(contents(halved / name), contents(whole / name)) << name;
      }
    }
  }
}

TEST(TrackJob, OtherSettingsAreNotResumed) {
  const Scratch out;
  TrackJobOptions options;
  EXPECT_THROW(run(options, out / "t.####.ply", false, 8), Killed);
  options.track.tracker.velocity.kind = motion::Velocity::Total;
  for (const TrackJobFrame& f : run(options, out / "t.####.ply", true)) EXPECT_FALSE(f.kept);
}

TEST(TrackJob, RefusesAStateThatIsNone) {
  const Scratch out;
  EXPECT_THROW(run({}, out / "t.####.ply", false, 8), Killed);
  std::ofstream(out / "t.state.8.cbor") << "nothing of the kind";
  EXPECT_THROW(run({}, out / "t.####.ply", true), IoError);
}

TEST(TrackJob, RefusesWhatHasNoMeaning) {
  const Scratch out;
  TrackJobOptions options;
  options.track.checker = -1;
  EXPECT_THROW(run(options, out / "t.####.ply", false), InvalidInput);
  EXPECT_THROW(run({}, out / "t.ply", false), InvalidInput);
}

}  // namespace
}  // namespace meniscus::scene
