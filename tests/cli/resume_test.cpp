// Sequences whose program is killed, wherever it stands, and told to go on: the files are those of a run that was left
// alone.
#include "support/program.h"

#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <map>
#include <thread>

#include <fcntl.h>
#include <unistd.h>

namespace meniscus {
namespace {

namespace fs = std::filesystem;
using test::contents;
using test::Scratch;

const std::string kDrops = MENISCUS_SOURCE_DIR "/examples/data/drops.lammpstrj.gz";

/// Names (without the hidden ones of a writer that was killed) and contents of a folder's files.
std::map<std::string, std::string> files_of(const std::string& folder) {
  std::map<std::string, std::string> out;
  for (const auto& entry : fs::directory_iterator(folder))
    if (const std::string name = entry.path().filename().string(); name[0] != '.')
      out[name] = contents(entry.path().string());
  return out;
}

/// Whether a file's name contains `part`; a part that begins with a point asks for a hidden one, still being written.
bool has(const std::string& folder, const std::string& part) {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (part[0] == '.' ? name.starts_with(part) : name[0] != '.' && name.find(part) != name.npos) return true;
  }
  return false;
}

/// The program at work in a folder.
class Running {
 public:
  Running(const std::string& folder, std::vector<std::string> words) : folder_(folder) {
    child_ = fork();
    if (child_ != 0) return;
    const int nowhere = open("/dev/null", O_RDWR);
    for (const int stream : {0, 1, 2}) dup2(nowhere, stream);
    words.insert(words.begin(), "meniscus");
    std::vector<char*> line;
    for (std::string& w : words) line.push_back(w.data());
    line.push_back(nullptr);
    if (chdir(folder.c_str()) == 0) execv(MENISCUS_BINARY_DIR "/bin/meniscus", line.data());
    _exit(127);
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  ~Running() {
    if (child_ <= 0) return;
    kill(child_, SIGKILL);
    code();
  }

  /// Waits until there is a file with this name (or, should it have come and gone unseen, the other), then sends the signal.
  /// Returns the exit code, or 128 and the signal it died of.
  int after(const std::string& part, const std::string& at_latest, int signal) {
    while (!has(folder_, part) && !has(folder_, at_latest) && !ended())
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    if (child_ > 0) kill(child_, signal);
    return code();
  }
  int code() {
    if (child_ > 0) waitpid(child_, &status_, 0);
    child_ = -1;
    return WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_);
  }

 private:
  bool ended() {
    if (waitpid(child_, &status_, WNOHANG) == 0) return false;
    child_ = -1;
    return true;
  }
  std::string folder_;
  pid_t child_ = -1;
  int status_ = 0;
};

std::vector<std::string> skin(const std::vector<std::string>& more) {
  std::vector<std::string> words{
      "skin", kDrops,     "--fps", "1",     "--radius",      "0.8",        "--voxel", "0.6", "--min-neighbours",
      "3",    "--frames", "1-6",   "--vdb", "skin.####.vdb", "--velocity", "-q",      "-o",  "skin.####.ply"};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

class KilledSkin : public testing::TestWithParam<std::vector<std::string>> {};

TEST_P(KilledSkin, GoesOnAsIfNothingHadBeen) {
  const Scratch alone, killed;
  ASSERT_EQ(Running(alone / "", skin(GetParam())).code(), 0);
  std::vector<std::string> again = GetParam();
  again.emplace_back("--resume");
  // In the middle of a mesh, of a grid, between the files of a state, before and after the manifest knows of a frame.
  const std::pair<const char*, const char*> moments[] = {
      {".skin.0001.ply", "skin.0001.ply"},   {"skin.0001.ply", "skin.0001.ply"},  {"skin.0002.vdb", "skin.0002.vdb"},
      {"skin.state.3.vdb", "skin.0004.ply"}, {".skin.0004.vdb", "skin.0004.vdb"}, {"skin.state.4.json", "skin.0005.ply"},
      {".skin.manifest", "skin.0005.ply"},   {"skin.0005.ply", "skin.0005.ply"}};
  for (const auto& [moment, at_latest] : moments)
    EXPECT_EQ(Running(killed / "", skin(again)).after(moment, at_latest, SIGKILL), 128 + SIGKILL) << moment;
  // Killed right after the manifest, a run leaves an older state: it goes when the next goes on.
  std::ofstream(killed / "skin.state.1.json") << "{}";
  ASSERT_EQ(Running(killed / "", skin(again)).code(), 0);
  const auto expected = files_of(alone / ""), found = files_of(killed / "");
  EXPECT_GE(expected.size(), 15u);
  for (const auto& [name, bytes] : expected) {
    ASSERT_TRUE(found.contains(name)) << name;
    EXPECT_TRUE(found.at(name) == bytes) << name;
  }
  EXPECT_EQ(found.size(), expected.size());
}

INSTANTIATE_TEST_SUITE_P(Meshes, KilledSkin,
                         testing::Values(std::vector<std::string>{}, std::vector<std::string>{"--persistent"}));

TEST(InterruptedSkin, SaysSoByItsCodeAndGoesOn) {
  const Scratch alone, broken;
  ASSERT_EQ(Running(alone / "", skin({})).code(), 0);
  EXPECT_EQ(Running(broken / "", skin({"--resume"})).after("skin.0001.ply", "skin.0001.ply", SIGINT), 130);
  EXPECT_EQ(Running(broken / "", skin({"--resume"})).after("skin.0003.ply", "skin.0003.ply", SIGTERM), 143);
  for (const auto& entry : fs::directory_iterator(broken / ""))
    EXPECT_NE(entry.path().filename().string()[0], '.') << "a file half written stays: " << entry.path();
  ASSERT_EQ(Running(broken / "", skin({"--resume"})).code(), 0);
  EXPECT_TRUE(files_of(broken / "") == files_of(alone / ""));
}

}  // namespace
}  // namespace meniscus
