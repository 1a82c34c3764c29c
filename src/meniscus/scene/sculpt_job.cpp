#include <meniscus/scene/sculpt_job.h>

#include <meniscus/base/error.h>
#include <meniscus/io/frames.h>
#include <meniscus/io/msurf.h>
#include <meniscus/scene/point_surface.h>

#include <algorithm>
#include <filesystem>

namespace meniscus::scene {

namespace {

/// The points of a file with unit normals, ready to be fitted: a mesh's vertices take the normals of its faces.
points::Cloud oriented_cloud(const std::string& path, const pointset::NormalOptions& options, SculptJobReport& report,
                             const RunControl& run) {
  points::Cloud cloud = points_of(io::read_geometry(path, {}, &report.read));
  cloud.attributes.erase(attribute::kRadius);  // told the spacing of a sampling, which strokes change
  try {
    return pointset::with_normals(cloud, options, &report.normals, run);
  } catch (const InvalidInput& e) {
    throw IoError(path, e.what());
  }
}

}  // namespace

std::string motion_path(const std::string& output, long frame) {
  const std::filesystem::path path(output);
  const std::string name = path.stem().string() + ".####" + path.extension().string();
  return io::FramePattern::parse((path.parent_path() / name).string())->path(frame);
}

SculptJobReport run_sculpt_job(const std::string& input, const SculptScript& script, const SculptJobOptions& options,
                               const std::function<void(const SculptJobStroke&)>& on_stroke, RunControl run) {
  SculptJobReport report;
  const points::Cloud cloud = oriented_cloud(input, options.normals, report, run.part(0, 0.05));
  pointset::SculptorOptions sculpting;
  sculpting.fit = options.fit;
  sculpting.fit.outlier_ratio = 0;  // with_normals has left them out
  sculpting.spacing = script.spacing;
  sculpting.resample = options.resample;
  pointset::Sculptor sculptor(pointset::fit(cloud, sculpting.fit, &report.fit, run.part(0.05, 0.1)), sculpting);

  const auto on_step = [&](const pointset::PointSet& set) {
    const long frame = ++report.steps;
    if (!std::binary_search(options.frames.begin(), options.frames.end(), frame)) return;
    const points::Cloud shown = to_cloud(set);
    report.frames.push_back({frame, motion_path(options.output, frame), shown.size(), points::bounds(shown)});
    io::write_cloud(report.frames.back().path, shown, options.write);
  };
  const double share = 0.9 / static_cast<double>(script.commands.size());
  for (std::size_t i = 0; i < script.commands.size(); ++i) {
    const SculptCommand& command = script.commands[i];
    const RunControl part = run.part(0.1 + share * static_cast<double>(i), 0.1 + share * static_cast<double>(i + 1));
    part.progress(0, "sculpt");
    SculptJobStroke done{command.stroke.label, command.where, {}};
    if (command.kind == SculptCommand::Kind::Stroke)
      done.report = sculptor.apply(command.stroke, on_step, part);
    else
      command.kind == SculptCommand::Kind::Undo ? sculptor.undo() : sculptor.redo();
    done.report.points = sculptor.set().size();
    report.strokes.push_back(done);
    if (on_stroke) on_stroke(done);
  }
  report.result = to_cloud(sculptor.set());
  if (io::format_of_path(options.output) == "msurf") {
    pointset::Solid solid;
    solid.set = sculptor.set();
    io::write_msurf(options.output, solid, options.write);
  } else {
    io::write_cloud(options.output, report.result, options.write);
  }
  run.progress(1);
  return report;
}

}  // namespace meniscus::scene
