#include "cli.h"

#include <meniscus/io/frames.h>
#include <meniscus/scene/sculpt_job.h>

#include <fmt/format.h>

#include <memory>

namespace meniscus::cli {
namespace {

struct SculptVerb {
  std::string cloud, script;
  std::string frames;
  std::size_t neighbours = pointset::FitOptions{}.neighbours;
  bool no_resample = false;

  void run(Session& session) const;
};

nlohmann::json to_json(const scene::SculptJobStroke& s) {
  const pointset::StrokeReport& r = s.report;
  return {{"label", s.label},
          {"voxels", r.voxels},
          {"points", r.points},
          {"moved", r.moved},
          {"inserted", r.inserted},
          {"removed", r.removed},
          {"lost", r.lost},
          {"stages", r.stages},
          {"seconds_dynamics", r.seconds_dynamics},
          {"seconds_points", r.seconds_points}};
}

void warn_about(const pointset::NormalReport& n, const std::string& path, Session& session) {
  const std::size_t dropped = n.not_finite + n.coincident + n.outliers + n.undetermined;
  if (dropped > 0)
    session.warn("dropped-points",
                 fmt::format("{} points were left out: {} not finite, {} coincident, {} outliers, {} without a plane",
                             dropped, n.not_finite, n.coincident, n.outliers, n.undetermined),
                 path);
  if (n.failed > 0)
    session.warn("normals", fmt::format("{} normals disagree with those of their neighbours", n.failed), path);
}

void SculptVerb::run(Session& session) const {
  if (neighbours < 1) throw UsageError("--neighbours must be 1 or more");
  scene::SculptJobOptions options;
  options.fit.neighbours = neighbours;
  options.resample = !no_resample;
  options.output = session.output();
  options.write = session.write_options();
  if (!frames.empty()) options.frames = io::parse_frames(frames);
  const RunControl run = session.run();
  session.add_input(cloud);
  session.add_input(script);
  const scene::SculptScript commands = scene::load_sculpt_script(script);
  session.timing("read");

  nlohmann::json& strokes = session.report()["strokes"] = nlohmann::json::array();
  const auto on_stroke = [&](const scene::SculptJobStroke& s) {
    strokes.push_back(to_json(s));
    if (s.report.full) session.warn("full", "no more points can be inserted: gaps are left", s.where);
    if (session.verbose())
      session.say(fmt::format("{}: {} points moved, {} inserted, {} removed, {:.3f} s", s.label, grouped(s.report.moved),
                              grouped(s.report.inserted), grouped(s.report.removed),
                              s.report.seconds_dynamics + s.report.seconds_points));
  };
  const scene::SculptJobReport report = scene::run_sculpt_job(cloud, commands, options, on_stroke, run);
  session.warn(report.read);
  warn_about(report.normals, cloud, session);
  for (const scene::SculptJobFrame& f : report.frames)
    session.report()["outputs"].push_back(
        {{"path", f.path}, {"frame", f.frame}, {"points", f.points}, {"bbox", cli::to_json(f.bounds)}});
  if (!options.frames.empty() && options.frames.back() > report.steps)
    session.warn("frames", fmt::format("the motion has {} steps; later frames are not there", report.steps));
  session.report()["points"] = report.result.size();
  session.report()["steps"] = report.steps;
  session.add_output_file(session.output(), report.result);
  session.timing("sculpt");
  session.say(fmt::format("{}: {} points after {} strokes", session.output(), grouped(report.result.size()),
                          grouped(report.strokes.size())));
}

}  // namespace

void add_sculpt(CLI::App& app, Session& session) {
  CLI::App* verb = app.add_subcommand("sculpt",
                                      "Push, crease, smooth and emboss a cloud's surface by a script of strokes.\n\n"
                                      "Example: meniscus sculpt head.ply strokes.json -o sculpted.ply");
  auto state = std::make_shared<SculptVerb>();
  verb->add_option("cloud", state->cloud, "points, with normals or without, or a mesh's vertices")->required();
  verb->add_option("script", state->script, "strokes in JSON: see docs/algorithms/sculpting.md and `meniscus schema sculpt`")
      ->required();
  verb->add_option(
      "--frames", state->frames,
      "steps of the motion to write as well, OUT.####.ply: 1-48, 1-100x2; a step is one of a force's dynamics or a "
      "stage of another tool");
  verb->add_option("--neighbours", state->neighbours, "points each local function is fitted to; default 20");
  verb->add_flag("--no-resample", state->no_resample, "insert and remove no points, but where the surface vanishes");
  session.add_output(*verb);
  session.add_common(*verb);
  verb->callback([state, &session] { state->run(session); });
}

}  // namespace meniscus::cli
