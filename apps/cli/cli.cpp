#include "cli.h"

#include <meniscus/base/suggest.h>

#include <fmt/format.h>

#include <unistd.h>

#include <atomic>
#include <cmath>
#include <cstdio>

#include <signal.h>

namespace meniscus::cli {
namespace {

// What the signal handler needs; lives as long as the process.
RunControl* running = nullptr;
std::atomic<int> caught{0};

void on_signal(int number) {
  // A second signal does not wait for the job to notice the first.
  if (caught.exchange(number) != 0) _exit(128 + number);
  if (running != nullptr) running->cancel();
}

void catch_signals() {
  struct sigaction action = {};
  action.sa_handler = on_signal;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

/// Draws progress on stderr: a bar that redraws itself, or one JSON object a line.
class ProgressPrinter {
 public:
  explicit ProgressPrinter(bool json) : json_(json) {}

  void operator()(double fraction, std::string_view stage) {
    if (!stage.empty()) stage_ = stage;
    const int percent = static_cast<int>(100 * fraction);
    if (percent == percent_) return;
    percent_ = percent;
    if (json_)
      fmt::print(stderr, "{}\n", nlohmann::json{{"progress", fraction}, {"stage", stage_}}.dump());
    else
      fmt::print(stderr, "\r\033[K[{:-<30}] {:3}% {}", std::string(static_cast<std::size_t>(percent * 3 / 10), '#'), percent,
                 stage_);
    if (!json_ && fraction >= 1) fmt::print(stderr, "\r\033[K");
    std::fflush(stderr);
  }

 private:
  bool json_;
  int percent_ = -1;
  std::string stage_;
};

}  // namespace

void Session::start(int argc, char** argv) {
  for (int i = 0; i < argc; ++i) {
    const std::string word = i == 0 ? "meniscus" : argv[i];
    const bool plain = !word.empty() && word.find_first_of(" \t\"'$*?#;&|<>()\\") == std::string::npos;
    command_line_ += plain ? fmt::format("{}{}", i == 0 ? "" : " ", word) : fmt::format(" '{}'", word);
  }
  report_ = {{"tool", "meniscus"},
             {"version", MENISCUS_VERSION},
             {"command", command_line_},
             {"status", "ok"},
             {"inputs", nlohmann::json::array()},
             {"outputs", nlohmann::json::array()},
             {"timings_s", nlohmann::json::object()},
             {"warnings", nlohmann::json::array()}};
  stage_start_ = std::chrono::steady_clock::now();
}

void Session::add_common(CLI::App& verb) {
  verb.add_flag("-q,--quiet", quiet_, "say nothing but errors");
  verb.add_flag("-v,--verbose", verbosity_, "say more");
  verb.add_flag("--json", json_, "print a report in JSON on stdout");
  verb.add_option("--progress", progress_, "auto (bar on a terminal), bar, json (lines on stderr) or none; default auto")
      ->check(CLI::IsMember({"auto", "bar", "json", "none"}));
  verb.add_option("--threads", threads_, "worker threads; default all cores. Results do not depend on it")
      ->check(CLI::Range(1, 1024));
  verb.add_option("--seed", seed_, "key of all random numbers; default 0");
}

void Session::add_output(CLI::App& verb, bool required) {
  auto* o = verb.add_option("-o,--output", output_, "file to write; the extension tells the format");
  if (required) o->required();
  verb.add_flag("-f,--force", force_, "replace existing files");
}

RunControl Session::run() {
  const bool bar = progress_ == "bar" || (progress_ == "auto" && !quiet_ && isatty(STDERR_FILENO) != 0);
  RunOptions options;
  options.threads = threads_;
  options.seed = seed_;
  if (bar || progress_ == "json") options.on_progress = ProgressPrinter(progress_ == "json");
  static RunControl control;
  control = RunControl(std::move(options));
  running = &control;
  catch_signals();
  return control;
}

io::WriteOptions Session::write_options() const {
  io::WriteOptions w;
  w.overwrite = force_;
  w.comments = {command_line_};
  return w;
}

void Session::add_input(const std::string& path) { report_["inputs"].push_back(path); }

void Session::add_output_file(const std::string& path, const mesh::Mesh& mesh, std::optional<long> frame) {
  nlohmann::json o{{"path", path},
                   {"points", mesh.positions.size()},
                   {"triangles", mesh.triangles.size()},
                   {"bbox", to_json(mesh::bounds(mesh))}};
  if (frame) o["frame"] = *frame;
  report_["outputs"].push_back(std::move(o));
}

void Session::add_output_file(const std::string& path, const points::Cloud& cloud, std::optional<long> frame) {
  nlohmann::json o{{"path", path}, {"points", cloud.size()}, {"bbox", to_json(points::bounds(cloud))}};
  if (frame) o["frame"] = *frame;
  report_["outputs"].push_back(std::move(o));
}

void Session::add_output_file(const std::string& path) { report_["outputs"].push_back({{"path", path}}); }

void Session::warn(const std::string& code, const std::string& message, const std::string& where) {
  report_["warnings"].push_back({{"code", code}, {"message", message}, {"where", where}});
  if (!quiet_) fmt::print(stderr, "meniscus: warning: {}{}{}\n", where, where.empty() ? "" : ": ", message);
}

void Session::warn(const io::ReadReport& read) {
  const nlohmann::json& told = report_["warnings"];
  for (const io::Warning& w : read.warnings)
    if (std::none_of(told.begin(), told.end(), [&](const auto& t) { return t["code"] == w.code && t["where"] == w.where; }))
      warn(w.code, w.message, w.where);
}

void Session::timing(const std::string& stage) {
  const auto now = std::chrono::steady_clock::now();
  const double seconds = std::chrono::duration<double>(now - stage_start_).count();
  auto& entry = report_["timings_s"][stage];
  entry = (entry.is_number() ? entry.get<double>() : 0.0) + seconds;
  stage_start_ = now;
}

void Session::say(const std::string& line) const {
  if (!quiet_) fmt::print(stderr, "{}\n", line);
}

void Session::print(const std::string& text) const {
  if (json_) return;
  fmt::print("{}", text);
}

void Session::fail_check(const std::string& what) {
  check_failed_ = true;
  fmt::print(stderr, "meniscus: check failed: {}\n", what);
}

int Session::finish(const std::string& command, int code, const std::string& error) {
  if (caught == SIGTERM && code == kInterrupted) code = kTerminated;
  if (code == kOk && check_failed_) code = kCheck;
  if (!error.empty()) fmt::print(stderr, "meniscus: {}{}{}\n", command, command.empty() ? "" : ": ", error);
  if (json_) {
    report_["status"] = code == kOk ? "ok" : code == kCheck ? "check-failed" : code >= kInterrupted ? "cancelled" : "error";
    if (!error.empty()) report_["error"] = error;
    fmt::print("{}\n", report_.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
  }
  // A full disk shows at the latest here.
  if (std::fflush(stdout) != 0 && code == kOk) {
    fmt::print(stderr, "meniscus: cannot write to standard output\n");
    return kOutput;
  }
  return code;
}

void SurfaceInput::add_to(CLI::App& verb, bool several_files) {
  auto* files =
      verb.add_option("input", files_, "scene (.json), mesh, level set (.vdb), or particle file or sequence (p.####.ply)");
  files->required();
  if (!several_files) files->expected(1);
  verb.add_option("--radius", radius_,
                  "radius of particles, world units; default: their own, or 0.75 of the spacing their density tells");
  verb.add_option("--frames", frames_, "frames to do: 1-48, 1-100x2, 5,9,12-20");
  verb.add_option("--missing", missing_, "for a gap in a sequence: error, skip or hold; default error")
      ->check(CLI::IsMember({"error", "skip", "hold"}));
  verb.add_option("--time", time_, "moment of a moving scene, seconds; default 0");
  verb.add_option("--fps", fps_, "frames per second; default: the scene's, or 24");
  verb.add_option("--set", set_, "NAME=VALUE: give a parameter of the scene another value");
}

scene::SourceOptions SurfaceInput::options() const {
  scene::SourceOptions o;
  o.radius = radius_;
  o.time = time_;
  o.fps = fps_;
  if (radius_ && !(std::isfinite(*radius_) && *radius_ > 0)) throw UsageError("--radius must be above zero");
  if (fps_ && !(std::isfinite(*fps_) && *fps_ > 0)) throw UsageError("--fps must be above zero");
  if (time_ && !frames_.empty()) throw UsageError("--time and --frames exclude each other");
  try {
    if (!frames_.empty()) o.frames = io::parse_frames(frames_);
  } catch (const InvalidInput& e) {
    throw UsageError(std::string("--frames: ") + e.what());
  }
  o.missing = missing_ == "skip" ? io::Missing::Skip : missing_ == "hold" ? io::Missing::Hold : io::Missing::Error;
  for (const std::string& s : set_) {
    const auto eq = s.find('=');
    double value = 0;
    if (eq == std::string::npos || !CLI::detail::lexical_cast(s.substr(eq + 1), value) || !std::isfinite(value))
      throw UsageError("--set takes NAME=VALUE with a number, not '" + s + "'");
    o.set.emplace_back(s.substr(0, eq), value);
  }
  return o;
}

scene::SurfaceSource SurfaceInput::open(Session& session, const RunControl& run) const {
  for (const std::string& f : files_) session.add_input(f);
  scene::SourceOptions o = options();
  o.on_read = [&session](const io::ReadReport& read) { session.warn(read); };
  return scene::SurfaceSource(files_, std::move(o), run);
}

std::vector<std::string> output_paths(const std::string& output, const std::vector<long>& frames) {
  const auto pattern = io::FramePattern::parse(output);
  if (!pattern) {
    if (frames.size() > 1)
      throw UsageError("there are " + std::to_string(frames.size()) +
                       " frames: the output needs a place for the number (out.####.ply), or --frames one of them");
    return {output};
  }
  if (frames.empty()) throw UsageError("the output has a place for a frame number, but there are no frames");
  std::vector<std::string> paths;
  for (const long f : frames) paths.push_back(pattern->path(f));
  return paths;
}

nlohmann::json to_json(const Box& box) {
  if (box.empty()) return nullptr;
  const auto number = [](double v) { return std::isfinite(v) ? nlohmann::json(v) : nlohmann::json(nullptr); };
  return {{number(box.min.x()), number(box.min.y()), number(box.min.z())},
          {number(box.max.x()), number(box.max.y()), number(box.max.z())}};
}

std::string grouped(std::size_t n) {
  std::string s = std::to_string(n);
  for (std::ptrdiff_t i = static_cast<std::ptrdiff_t>(s.size()) - 3; i > 0; i -= 3)
    s.insert(static_cast<std::size_t>(i), ",");
  return s;
}

Vec3 parse_vector(const std::string& text, const std::string& option) {
  Vec3 v;
  std::size_t begin = 0;
  for (int a = 0; a < 3; ++a) {
    const std::size_t comma = a < 2 ? text.find(',', begin) : text.size();
    double value = 0;
    if (comma == std::string::npos ||
        !CLI::detail::lexical_cast(CLI::detail::trim_copy(text.substr(begin, comma - begin)), value) ||
        !std::isfinite(value))
      throw UsageError(option + " takes three numbers x,y,z, not '" + text + "'");
    v[a] = value;
    begin = comma + 1;
  }
  return v;
}

Box parse_box(const std::string& text) {
  const auto arrow = text.find("->");
  if (arrow == std::string::npos) throw UsageError("--box takes \"x,y,z -> x,y,z\", not '" + text + "'");
  const Box b{parse_vector(text.substr(0, arrow), "--box"), parse_vector(text.substr(arrow + 2), "--box")};
  if (b.empty()) throw UsageError("--box: the first corner must be the lower one");
  return b;
}

}  // namespace meniscus::cli
