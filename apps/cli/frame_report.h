#pragma once

#include "cli.h"

#include <meniscus/scene/living_surface.h>

namespace meniscus::cli {

/// The options of verbs that write a living surface: --vdb, --velocity, --fps, --resume.
struct SequenceFlags {
  std::string grids;
  bool velocities = false, persistent = false, resume = false;
  double fps = 24;

  void add_to(CLI::App& verb) {
    verb.add_option("--fps", fps, "frames per second: the unit of velocities; default 24")->check(CLI::PositiveNumber);
    verb.add_option("--vdb", grids, "also write the level set of every frame: name.####.vdb");
    verb.add_flag("--velocity", velocities, "with --vdb: a grid \"velocity\" beside the level set; vertices always have v")
        ->needs("--vdb");
    verb.add_flag(
        "--persistent", persistent,
        "the same vertices from frame to frame, with ids; meshed anew only where the surface tears, joins or stretches");
    verb.add_flag("--resume", resume, "go on after the last frame that an earlier run of the same settings finished");
  }
  /// Throws UsageError for an output of several frames without a place for the number.
  scene::SequenceOutput output(const Session& session, const std::vector<long>& frames) const {
    for (const std::string& name : {session.output(), grids})
      if (!name.empty()) output_paths(name, frames);
    scene::SequenceOutput o;
    o.meshes = session.output();
    if (!grids.empty()) o.grids = grids;
    o.velocity_grids = velocities;
    o.fps = fps;
    o.persistent = persistent;
    o.resume = resume;
    o.write = session.write_options();
    return o;
  }
};

/// Enters a written frame into the report: `row` is what the verb has to say of it.
inline void report_frame(Session& session, const scene::FrameRecord& f, nlohmann::json row) {
  if (f.kept) row = {{"frame", f.frame}, {"kept", true}};
  if (f.change) row.update(scene::to_json(*f.change));
  session.report()["frames"].push_back(std::move(row));
  nlohmann::json out{{"path", f.path}, {"frame", f.frame}};
  if (!f.kept) out.update({{"points", f.vertices}, {"triangles", f.triangles}, {"bbox", to_json(f.bounds)}});
  session.report()["outputs"].push_back(std::move(out));
}

}  // namespace meniscus::cli
