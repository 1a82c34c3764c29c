// Every verb that computes gives the same bytes for any number of threads.
#include "support/program.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <map>

namespace meniscus {
namespace {

using test::contents;
using test::meniscus_program;
using test::Scratch;

const std::string kScenes = MENISCUS_SOURCE_DIR "/scenes/";
const std::string kExamples = MENISCUS_SOURCE_DIR "/examples/";
const std::string kDrops = MENISCUS_SOURCE_DIR "/examples/data/drops.lammpstrj.gz";

/// A command line without output folder and threads; FOLDER stands for the former, INPUTS for a folder that inputs() filled.
struct Line {
  const char* name;
  std::string arguments;

  friend void PrintTo(const Line& line, std::ostream* out) { *out << line.arguments; }
};

std::string filled_in(std::string text, const std::string& mark, const std::string& value) {
  for (std::size_t at = 0; (at = text.find(mark, at)) != std::string::npos; at += value.size())
    text.replace(at, mark.size(), value);
  return text;
}

/// The bytes of every file of a folder, without the line of the command where a file keeps it: in a picture that and a
/// checksum stand in front of the pixels.
std::map<std::string, std::string> files_of(const std::string& folder, const std::string& threads) {
  std::map<std::string, std::string> files;
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    std::string bytes = contents(file.path());
    if (file.path().extension() == ".png") bytes = bytes.substr(bytes.find("IDAT"));
    files[file.path().filename()] = filled_in(filled_in(bytes, folder, ""), threads, "");
  }
  return files;
}

/// Clouds and a script, made once: they are inputs of verbs whose results are compared.
const std::string& inputs() {
  static const Scratch folder;
  static const std::string path =
      [] {
        for (const std::string name : {"torus", "sphere"}) {
          const std::string cloud = folder / (name + ".ply");
          const std::string sample = "sample " + kExamples + "torus_and_sphere/" + name + ".json --fast --count 1500";
          EXPECT_EQ(meniscus_program(sample + " -q -o " + cloud).code, 0);
          EXPECT_EQ(meniscus_program("fit " + cloud + " -q -o " + (folder / (name + ".msurf"))).code, 0);
        }
        std::ofstream(folder / "script.json")
            << R"({"strokes":[{"tool":"force","path":[0,0,0.5],"radius":0.4,"strength":0.1,"voxels":20,"steps":4}]})";
        return folder / "";
      }();
  return path;
}

class Threads : public testing::TestWithParam<Line> {};

TEST_P(Threads, DoNotChangeAByte) {
  std::map<std::string, std::string> one;
  for (const int threads : {1, 2, 3, 5, 8}) {
    const Scratch folder;
    const std::string option = " --threads " + std::to_string(threads);
    std::string line = filled_in(GetParam().arguments, "FOLDER/", folder / "");
    line = filled_in(line, "INPUTS/", inputs());
    const auto ran = meniscus_program(line + " -q" + option);
    ASSERT_EQ(ran.code, 0) << ran.err;
    const auto files = files_of(folder / "", option);
    ASSERT_FALSE(files.empty());
    if (one.empty()) one = files;
    ASSERT_EQ(files.size(), one.size());
    for (const auto& [name, bytes] : files) EXPECT_TRUE(bytes == one[name]) << name << ", " << threads << " threads";
  }
}

INSTANTIATE_TEST_SUITE_P(
    Verbs, Threads,
    testing::Values(
        Line{"Mesh", "mesh " + kScenes + "csg_part.json -o FOLDER/m.ply"},
        Line{"MeshOfParticles", "mesh " + kDrops + " --frames 12 --radius 0.8 --voxel 0.5 -o FOLDER/m.ply"},
        Line{"SamplePacked",
             "sample " + kScenes +
                 "approaching_blobs.json --frames 1-3 --spacing 0.15 --mesh FOLDER/t.####.ply -o FOLDER/p.####.ply"},
        Line{"SampleFloaters", "sample " + kScenes + "two_blobs.json --method floaters --spacing 0.12 -o FOLDER/p.ply"},
        Line{"Edit", "edit " + kExamples + "pulled_row/row.json --script " + kExamples +
                         "pulled_row/strokes.json --metric surface -o FOLDER/e.json"},
        Line{"TrackBlended",
             "track " + kScenes + "turning_blobs.json --velocity blended --voxel 0.15 --frames 1-3 -o FOLDER/t.####.ply"},
        Line{"TrackIsometric",
             "track " + kScenes + "turning_blobs.json --velocity isometric --voxel 0.15 --frames 1-3 -o FOLDER/t.####.ply"},
        Line{"Skin", "skin " + kDrops +
                         " --fps 1 --radius 0.8 --voxel 0.7 --min-neighbours 3 --frames 9-11 --persistent "
                         "--vdb FOLDER/g.####.vdb --velocity -o FOLDER/s.####.ply"},
        Line{"Morph",
             "morph " + kScenes + "ball.json " + kScenes + "torus_knot.json --frames 4 --voxel 0.15 -o FOLDER/m.####.ply"},
        Line{"Fit", "fit INPUTS/torus.ply -o FOLDER/f.msurf"},
        Line{"Sculpt", "sculpt INPUTS/torus.ply INPUTS/script.json -o FOLDER/s.ply"},
        Line{"Boolean", "boolean difference INPUTS/torus.msurf INPUTS/sphere.msurf -o FOLDER/b.msurf"},
        Line{"Render", "render " + kScenes + "turning_blobs.json --size 120x90 --samples 4 -o FOLDER/r.png"},
        Line{"RenderCloud", "render INPUTS/torus.ply --upsample --size 120x90 --samples 2 -o FOLDER/r.png"}),
    [](const auto& line) { return line.param.name; });

}  // namespace
}  // namespace meniscus
