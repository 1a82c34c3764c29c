#include "frame_report.h"

#include <meniscus/io/manifest.h>
#include <meniscus/scene/morph_job.h>

#include <fmt/format.h>

#include <memory>
#include <numeric>

namespace meniscus::cli {
namespace {

struct MorphVerb {
  std::string from, to;
  std::optional<double> voxel, radius;
  int frames = 24;
  double tension = 0;
  SequenceFlags sequence;

  void run(Session& session) const;
};

nlohmann::json row(const scene::MorphJobFrame& f) {
  return {{"frame", f.frame},          {"volume", f.morph.volume},
          {"area", f.morph.area},      {"components", f.morph.components},
          {"triangles", f.triangles},  {"active_nodes", f.morph.active_nodes},
          {"substeps", f.morph.steps}, {"distance_to_goal", f.morph.farthest},
          {"seconds", f.seconds}};
}

void MorphVerb::run(Session& session) const {
  const RunControl control = session.run();
  session.add_input(from);
  session.add_input(to);
  scene::SourceOptions source;
  source.radius = radius;
  source.on_read = [&session](const io::ReadReport& read) { session.warn(read); };
  const scene::Surface a = scene::SurfaceSource({from}, source, control.part(0, 0.05)).open({}, control);
  const scene::Surface b = scene::SurfaceSource({to}, source, control.part(0.05, 0.1)).open({}, control);
  session.timing("read");
  scene::MorphJobOptions job;
  Box box;
  box.extend(a.field->bounds());
  box.extend(b.field->bounds());
  if (!box.finite()) throw InvalidInput("both shapes of a morph must be bounded and not empty");
  job.morph.voxel = voxel.value_or(box.diameter() / 160);
  job.morph.frames = frames;
  job.morph.fps = sequence.fps;
  job.morph.tension = tension;
  std::vector<long> numbers(static_cast<std::size_t>(frames));
  std::iota(numbers.begin(), numbers.end(), 1);
  job.output = sequence.output(session, numbers);
  job.shapes = io::fingerprint_of_file(from) + " " + io::fingerprint_of_file(to) + " " + std::to_string(radius.value_or(0));
  session.report()["frames"] = nlohmann::json::array();
  bool grown = false;
  const auto on_frame = [&](const scene::MorphJobFrame& f) {
    report_frame(session, f, row(f));
    if (f.kept) return;
    session.say(fmt::format("{}: {} triangles, {:.2f} voxels from the goal, {:.2f} s", f.path, grouped(f.triangles),
                            f.morph.farthest, f.seconds));
    grown = f.morph.grown;
  };
  scene::run_morph_job(*a.field, *b.field, job, on_frame, control.part(0.1, 1));
  if (grown) session.warn("no-overlap", "parts of the goal do not meet the first shape: they grow from seeds");
  session.timing("morph");
  control.progress(1);
}

}  // namespace

void add_morph(CLI::App& app, Session& session) {
  CLI::App* verb = app.add_subcommand("morph",
                                      "Turn one shape into another, whatever their topology.\n\n"
                                      "Example: meniscus morph ball.json ring.obj --frames 48 -o m.####.ply");
  auto state = std::make_shared<MorphVerb>();
  verb->add_option("from", state->from, "first shape: scene, mesh, level set or particles")->required();
  verb->add_option("to", state->to, "last shape")->required();
  verb->add_option("--frames", state->frames, "how many, the first and last shape included; default 24");
  verb->add_option("--voxel", state->voxel, "cell size, world units; default: a 160th of the diameter of both")
      ->check(CLI::PositiveNumber);
  verb->add_option("--tension", state->tension, "surface tension on the way, units²/s; default 0");
  state->sequence.add_to(*verb);
  verb->add_option("--radius", state->radius, "of particles, world units")->check(CLI::PositiveNumber);
  session.add_output(*verb);
  session.add_common(*verb);
  verb->callback([state, &session] { state->run(session); });
}

}  // namespace meniscus::cli
