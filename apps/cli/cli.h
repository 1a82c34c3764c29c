#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/error.h>
#include <meniscus/base/run_control.h>
#include <meniscus/io/geometry.h>
#include <meniscus/io/sequence.h>
#include <meniscus/mesh/mesh.h>
#include <meniscus/points/cloud.h>
#include <meniscus/scene/surface_source.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

/// The command line: thin faces over the library. Every verb is one file verb_NAME.cpp with one
/// function add_NAME, declared and listed in main.cpp.
namespace meniscus::cli {

/// What the process answers, see INTERFACES in docs/command-line.md.
enum ExitCode {
  kOk = 0,
  kFailed = 1,
  kUsage = 2,
  kInput = 3,
  kOutput = 4,
  kCheck = 5,
  kInterrupted = 130,
  kTerminated = 143
};

/// A wrong command line that the parser cannot see (two options that exclude each other, a missing unit).
class UsageError : public Error {
 public:
  using Error::Error;
};

/// The options that every verb understands, and what it reports.
class Session {
 public:
  /// Adds the common options to a verb.
  void add_common(CLI::App& verb);
  /// Adds -o/--output and --force.
  void add_output(CLI::App& verb, bool required = true);

  /// A control that shows progress on the terminal and stops on Ctrl-C. Valid once the command line is parsed.
  RunControl run();

  const std::string& output() const { return output_; }
  bool force() const { return force_; }
  bool quiet() const { return quiet_; }
  bool verbose() const { return verbosity_ > 0; }
  bool json() const { return json_; }
  std::optional<int> threads() const { return threads_; }
  std::uint64_t seed() const { return seed_; }

  /// How files are written: replacing only with --force, signed with the command line.
  io::WriteOptions write_options() const;

  /// The --json report; verbs add their block ("mesh", "sampling", …) to it.
  nlohmann::json& report() { return report_; }
  void add_input(const std::string& path);
  void add_output_file(const std::string& path, const mesh::Mesh& mesh, std::optional<long> frame = {});
  void add_output_file(const std::string& path, const points::Cloud& cloud, std::optional<long> frame = {});
  void add_output_file(const std::string& path);
  void warn(const std::string& code, const std::string& message, const std::string& where = {});
  /// What a reader noticed, once a file and code however often the file is read.
  void warn(const io::ReadReport& read);
  /// Notes how long the stage since the last call (or the start) took.
  void timing(const std::string& stage);
  /// A line for people, on stderr; silent with -q.
  void say(const std::string& line) const;
  /// The result for people, on stdout; silent with --json, which prints the report there instead.
  void print(const std::string& text) const;
  /// Remembers that the result was made but did not pass a requested check (exit code 5).
  void fail_check(const std::string& what);

  /// Called by main: the process's arguments, and the end of a run.
  void start(int argc, char** argv);
  int finish(const std::string& command, int code, const std::string& error);

 private:
  std::string command_line_;
  std::string output_;
  bool force_ = false;
  bool quiet_ = false;
  int verbosity_ = 0;
  bool json_ = false;
  std::string progress_ = "auto";
  std::optional<int> threads_;
  std::uint64_t seed_ = 0;
  bool check_failed_ = false;
  nlohmann::json report_;
  std::chrono::steady_clock::time_point stage_start_;
};

/// The options of verbs that take any surface: --radius, --frames, --missing, --time, --fps, --set.
class SurfaceInput {
 public:
  void add_to(CLI::App& verb, bool several_files = true);
  scene::SourceOptions options() const;
  const std::vector<std::string>& files() const { return files_; }
  /// Opens the source and names it in the report.
  scene::SurfaceSource open(Session& session, const RunControl& run) const;

 private:
  std::vector<std::string> files_;
  std::optional<double> radius_;
  std::optional<double> time_;
  std::optional<double> fps_;
  std::string frames_;
  std::string missing_ = "error";
  std::vector<std::string> set_;
};

/// The names of output frames: the pattern's, or the plain path when there is a single frame.
std::vector<std::string> output_paths(const std::string& output, const std::vector<long>& frames);

nlohmann::json to_json(const Box& box);
/// "12,345" for people.
std::string grouped(std::size_t n);
/// "x,y,z" as a vector; throws UsageError that names `option`.
Vec3 parse_vector(const std::string& text, const std::string& option);
/// "x,y,z -> x,y,z", the lower corner first, as a box; throws UsageError.
Box parse_box(const std::string& text);

}  // namespace meniscus::cli
