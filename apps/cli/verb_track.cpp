#include "frame_report.h"

#include <meniscus/scene/track_job.h>

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <memory>

namespace meniscus::cli {
namespace {

struct TrackVerb {
  SurfaceInput input;
  std::string velocity = "blended";
  std::string as = "mesh";
  std::string integrator = "heun";
  int fairing = 0;
  int redistribute = scene::TrackOptions{}.redistribution;
  std::string start, grids;
  std::optional<double> voxel, checker;
  bool resume = false;

  void run(Session& session) const;
  scene::TrackJobOptions options(const Session& session) const;
};

const std::map<std::string, motion::Velocity> kVelocities{{"normal", motion::Velocity::Normal},
                                                          {"blended", motion::Velocity::Blended},
                                                          {"total", motion::Velocity::Total},
                                                          {"isometric", motion::Velocity::Isometric}};
const std::map<std::string, motion::Integrator> kIntegrators{
    {"euler", motion::Integrator::Euler}, {"heun", motion::Integrator::Heun}, {"rk4", motion::Integrator::RungeKutta4}};

scene::TrackJobOptions TrackVerb::options(const Session& session) const {
  if (voxel && !(std::isfinite(*voxel) && *voxel > 0)) throw UsageError("--voxel must be above zero");
  if (fairing > 0 && as == "points") throw UsageError("--fairing needs edges: it goes with --as mesh");
  scene::TrackJobOptions job;
  scene::TrackOptions& o = job.track;
  o.tracker.velocity.kind = kVelocities.at(velocity);
  o.tracker.integrator = kIntegrators.at(integrator);
  o.tracker.fairing = fairing;
  o.points = as == "points";
  o.redistribution = redistribute;
  o.voxel = voxel;
  o.checker = checker;
  if (!start.empty()) job.start = start;
  job.output.meshes = session.output();
  if (!grids.empty()) job.output.grids = grids;
  job.output.velocity_grids = true;
  job.output.resume = resume;
  job.output.write = session.write_options();
  return job;
}

nlohmann::json row(const scene::TrackJobFrame& f) {
  nlohmann::json j{{"frame", f.frame},
                   {"area_log_mean", f.step.area_log_mean},
                   {"area_log_max", f.step.area_log_max},
                   {"flips", f.step.flips},
                   {"max_distance", f.step.max_distance},
                   {"lost", f.step.lost},
                   {"singular", f.step.singular},
                   {"seconds_velocity", f.step.seconds_velocity},
                   {"seconds_fairing", f.step.seconds_fairing},
                   {"seconds", f.seconds}};
  if (f.born > 0) j["born"] = f.born;
  return j;
}

/// What happened beside being carried, for people.
std::string news(const scene::TrackJobFrame& f) {
  const std::string& why = f.change->reason;
  if (why.empty()) return f.born > 0 ? fmt::format(", {} born", grouped(f.born)) : "";
  if (why == "first") return "";
  if (f.triangles == 0) return fmt::format(", {}: {} born", why, grouped(f.born));
  return fmt::format(", {}: meshed anew in {} {}, {} vertices kept", why, f.change->regions.size(),
                     f.change->regions.size() == 1 ? "place" : "places", grouped(f.change->carried));
}

void TrackVerb::run(Session& session) const {
  const scene::TrackJobOptions job = options(session);
  const RunControl control = session.run();
  const scene::SurfaceSource source = input.open(session, control.part(0, 0.05));
  const auto frames = source.frames().empty() ? source.all_frames() : source.frames();
  if (!start.empty()) session.add_input(start);
  if (frames.empty()) throw UsageError("a single surface has nothing to track: give a moving scene or a sequence");
  output_paths(session.output(), frames);
  if (!grids.empty()) output_paths(grids, frames);
  session.report()["frames"] = nlohmann::json::array();
  session.timing("read");
  const auto heard = [&](const scene::TrackJobFrame& f) {
    report_frame(session, f, row(f));
    if (f.kept) return;
    if (f.vertices == 0) session.warn("empty", "the surface is empty at this voxel size", f.path);
    session.say(fmt::format("{}: {} vertices{}{}", f.path, grouped(f.vertices),
                            job.track.points ? "" : fmt::format(", distortion {:.4f}", f.step.area_log_mean), news(f)));
  };
  scene::run_track_job(source, job, heard, control.part(0.05, 1));
  session.timing("track");
}

}  // namespace

void add_track(CLI::App& app, Session& session) {
  CLI::App* verb = app.add_subcommand("track",
                                      "Carry a mesh or points along a moving surface, with velocities.\n\n"
                                      "Example: meniscus track scene.json --velocity total -o out.####.ply");
  auto state = std::make_shared<TrackVerb>();
  state->input.add_to(*verb);
  verb->add_option("--velocity", state->velocity,
                   "normal, blended (the primitives' mean), total (normals do not turn) or isometric (least strain); "
                   "default blended")
      ->check(CLI::IsMember({"normal", "blended", "total", "isometric"}));
  verb->add_option("--as", state->as, "mesh or points; default mesh")->check(CLI::IsMember({"mesh", "points"}));
  verb->add_option("--fairing", state->fairing, "rounds of edge springs a frame, 0 or more; default 0")
      ->check(CLI::Range(0, 1000));
  verb->add_option("--redistribute", state->redistribute, "frames between redistributions of points, 0 for none; default 12")
      ->check(CLI::Range(0, 1000000));
  verb->add_option("--integrator", state->integrator, "euler, heun or rk4; default heun")
      ->check(CLI::IsMember({"euler", "heun", "rk4"}));
  verb->add_option("--voxel", state->voxel,
                   "cell size of a new mesh, world units; default: a 128th of the surface's diameter, half the radius of "
                   "particles");
  verb->add_option("--checker", state->checker, "paint the first mesh with squares of this size, world units")
      ->check(CLI::PositiveNumber);
  verb->add_option(
          "--start", state->start,
          "mesh (or points) of the first frame's surface to begin with: all its attributes, uv or any, are carried along")
      ->check(CLI::ExistingFile);
  verb->add_option("--vdb", state->grids,
                   "also write the level set of every frame, with a grid \"velocity\" beside it: name.####.vdb");
  verb->add_flag("--resume", state->resume, "go on after the last frame that an earlier run of the same settings finished");
  session.add_output(*verb);
  session.add_common(*verb);
  verb->callback([state, &session] { state->run(session); });
}

}  // namespace meniscus::cli
