#include "cli.h"

#include <meniscus/io/msurf.h>
#include <meniscus/pointset/fit_quality.h>
#include <meniscus/scene/point_surface.h>

#include <fmt/format.h>

#include <chrono>
#include <memory>

namespace meniscus::cli {
namespace {

struct FitVerb {
  std::string input;
  std::size_t neighbours = pointset::FitOptions{}.neighbours;
  int grid = 3;
  std::string rows = "both";
  double smoothing = pointset::FitOptions{}.smoothing;

  void run(Session& session) const;
  pointset::FitOptions options() const;
};

pointset::FitOptions FitVerb::options() const {
  pointset::FitOptions o;
  o.neighbours = neighbours;
  o.grid = grid;
  using Rows = pointset::FitOptions::Rows;
  o.rows = rows == "gradient" ? Rows::Gradient : rows == "offset" ? Rows::Offset : Rows::Both;
  o.smoothing = smoothing;
  return o;
}

/// A line for everything that was left out or had to be guessed.
void warn_of_losses(const scene::PointSurfaceReport& r, const std::string& path, Session& session) {
  const auto lost = [&](std::size_t count, const char* code, const char* what) {
    if (count > 0) session.warn(code, fmt::format("{} points {}", grouped(count), what), path);
  };
  const auto& n = r.normals;
  lost(r.fit.not_finite + n.not_finite, "not-finite", "left out: a coordinate is not finite");
  lost(r.fit.coincident + n.coincident, "coincident", "left out: at the place of another");
  lost(r.fit.outliers + n.outliers, "outliers", "left out: far from all others");
  lost(r.fit.without_normal + n.undetermined, "undetermined", "left out: nothing tells their normal");
  if (r.estimated) lost(n.estimated, "estimated-normals", "had no normal: it is estimated");
  if (r.estimated) lost(n.failed, "orientation", "have normals that disagree with their neighbours'");
}

nlohmann::json block(const scene::PointSurfaceReport& r, const pointset::PointSet& set, double seconds,
                     const pointset::FitQuality& q) {
  return {{"points", r.fit.points},
          {"domains", set.size()},
          {"border_points", r.fit.border},
          {"seconds", seconds},
          {"max_value", q.max_value},
          {"mean_value", q.mean_value},
          {"mean_normal_error_deg", q.mean_normal_error},
          {"bytes", set.bytes()}};
}

void FitVerb::run(Session& session) const {
  const RunControl control = session.run();
  session.add_input(input);
  if (io::format_of_input(input) == "msurf") throw UsageError(input + " is a point-set surface already");
  if (io::format_of_path(session.output()) != "msurf") throw UsageError("the output of fit is an .msurf file");
  io::ReadReport read;
  points::Cloud cloud = scene::points_of(io::read_geometry(input, {}, &read));
  session.warn(read);
  session.timing("read");
  const auto start = std::chrono::steady_clock::now();
  scene::PointSurfaceReport report;
  const pointset::Solid solid = scene::point_surface(std::move(cloud), input, options(), &report, control.part(0, 0.8));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  session.timing("fit");
  io::write_msurf(session.output(), solid, session.write_options());
  session.add_output_file(session.output(), pointset::to_cloud(solid.set));
  session.timing("write");
  const pointset::FitQuality quality = pointset::fit_quality(solid.set, control);
  session.timing("check");
  warn_of_losses(report, input, session);
  session.report()["fit"] = block(report, solid.set, seconds, quality);
  session.say(fmt::format("{}: {} domains in {:.2f} s, {} bytes a point, mean value {:.3g}, normals {:.3g} degrees off",
                          session.output(), grouped(solid.set.size()), seconds, solid.set.bytes() / solid.set.size(),
                          quality.mean_value, quality.mean_normal_error));
  control.progress(1);
}

}  // namespace

void add_fit(CLI::App& app, Session& session) {
  CLI::App* verb = app.add_subcommand("fit",
                                      "Build a point-set surface from a cloud.\n\n"
                                      "Example: meniscus fit scan.ply -o scan.msurf");
  auto state = std::make_shared<FitVerb>();
  verb->add_option("input", state->input, "a cloud (missing normals are estimated), or a mesh whose vertices are taken")
      ->required();
  verb->add_option("--neighbours", state->neighbours, "points that each local function sees; default 20")
      ->check(CLI::Range(1, 1000));
  verb->add_option("--grid", state->grid, "control points along an axis of a local function; default 3")
      ->check(CLI::Range(3, pointset::kMostGrid));
  verb->add_option("--rows", state->rows,
                   "what is fitted beside the points: offset (points off the surface), gradient, or both; default both")
      ->check(CLI::IsMember({"offset", "gradient", "both"}));
  verb->add_option("--smoothing", state->smoothing, "weight of bending against the data; default 1e-5")
      ->check(CLI::NonNegativeNumber);
  session.add_output(*verb);
  session.add_common(*verb);
  verb->callback([state, &session] { state->run(session); });
}

}  // namespace meniscus::cli
