#include "cli.h"

#include <meniscus/field/combine.h>
#include <meniscus/io/msurf.h>
#include <meniscus/mesh/validate.h>
#include <meniscus/polygonize/polygonize.h>
#include <meniscus/scene/point_surface.h>

#include <fmt/format.h>

#include <memory>

namespace meniscus::cli {
namespace {

using pointset::Operation;

struct BooleanVerb {
  std::string operation, a, b;
  bool blend = false;
  bool mesh = false;
  std::optional<double> voxel;

  void run(Session& session) const;

 private:
  Operation kind() const {
    return operation == "union"          ? Operation::Union
           : operation == "intersection" ? Operation::Intersection
                                         : Operation::Difference;
  }
  void join_points(pointset::Solid first, pointset::Solid second, Session& session, const RunControl& control) const;
  void join_fields(std::unique_ptr<field::Field> first, std::unique_ptr<field::Field> second, bool open, Session& session,
                   const RunControl& control) const;
};

/// The point-set surface in a file; nothing if it holds something else.
std::optional<pointset::Solid> points_in(const std::string& path, Session& session, const RunControl& run) {
  const std::string format = io::format_of_input(path);
  if (format == "json" || format == "vdb") return std::nullopt;
  if (format == "msurf") return io::read_msurf(path);
  io::ReadReport read;
  io::Geometry g = io::read_geometry(path, {}, &read);
  session.warn(read);
  if (g.kind == io::Geometry::Kind::Mesh && !g.mesh.triangles.empty()) return std::nullopt;
  if (g.cloud.attributes.has(attribute::kRadius)) return std::nullopt;
  return scene::point_surface(std::move(g.cloud), path, {}, nullptr, run);
}

nlohmann::json block(const pointset::BooleanReport& r) {
  return {{"kept_a", r.kept_a}, {"kept_b", r.kept_b}, {"edge_points", r.edge_points}};
}

void BooleanVerb::join_points(pointset::Solid first, pointset::Solid second, Session& session,
                              const RunControl& control) const {
  pointset::Solid solid;
  solid.operation = kind();
  solid.inputs.push_back(std::move(first));
  solid.inputs.push_back(std::move(second));
  pointset::BooleanReport report;
  points::Cloud cloud = pointset::points_of(solid, &report, control.part(0.3, 0.8));
  session.timing("boolean");
  session.report()["boolean"] = block(report);
  if (cloud.empty()) session.warn("empty", "nothing is left");
  if (blend && !cloud.empty()) {
    solid = scene::point_surface(cloud, session.output(), {}, nullptr, control.part(0.8, 1));
    cloud = pointset::to_cloud(solid.set);
    session.timing("fit");
  }
  cloud.attributes.erase(attribute::kRadius);  // or other verbs would take the points for particles
  if (io::format_of_path(session.output()) == "msurf") {
    io::write_msurf(session.output(), solid, session.write_options());
  } else {
    if (report.edge_points > 0 && !blend)
      session.warn("soft-edges", "read back as a surface these points have soft edges: write an .msurf to keep them sharp",
                   session.output());
    io::write_cloud(session.output(), cloud, session.write_options());
  }
  session.add_output_file(session.output(), cloud);
  session.timing("write");
  session.say(fmt::format("{}: {} points of the first, {} of the second, {} on the edge", session.output(),
                          grouped(report.kept_a), grouped(report.kept_b), grouped(report.edge_points)));
}

void BooleanVerb::join_fields(std::unique_ptr<field::Field> first, std::unique_ptr<field::Field> second, bool open,
                              Session& session, const RunControl& control) const {
  Box box = first->bounds();
  box.extend(second->bounds());
  if (!box.finite() && !box.empty()) throw InvalidInput("both surfaces must be bounded");
  field::Inputs inputs;
  inputs.push_back(std::move(first));
  inputs.push_back(std::move(second));
  const auto joined = kind() == Operation::Union          ? field::set_union(std::move(inputs))
                      : kind() == Operation::Intersection ? field::set_intersection(std::move(inputs))
                                                          : field::set_difference(std::move(inputs));
  polygonize::PolygonizeOptions o;
  o.open = open;
  o.voxel = voxel.value_or(box.empty() ? 1 : box.diameter() / 128);
  const auto result = polygonize::polygonize(*joined, o, control.part(0.3, 0.9));
  session.timing("polygonize");
  for (const std::string& w : result.report.warnings) session.warn("polygonize", w, session.output());
  if (result.mesh.triangles.empty()) session.warn("empty", "nothing is left at this voxel size", session.output());
  io::write_mesh(session.output(), result.mesh, session.write_options());
  session.add_output_file(session.output(), result.mesh);
  session.timing("write");
  session.say(fmt::format("{}: {} triangles", session.output(), grouped(result.mesh.triangles.size())));
}

void BooleanVerb::run(Session& session) const {
  const RunControl control = session.run();
  session.add_input(a);
  session.add_input(b);
  auto first = points_in(a, session, control.part(0, 0.15)), second = points_in(b, session, control.part(0.15, 0.3));
  if (first && second && !mesh) {
    session.timing("read");
    join_points(std::move(*first), std::move(*second), session, control);
  } else {
    if (blend) throw UsageError("--blend joins points; " + (first ? b : a) + " is none, or --mesh was asked for");
    if (io::format_of_path(session.output()) == "msurf")
      throw UsageError("an .msurf holds points, but " +
                       (mesh ? "--mesh was asked for"
                             : (first ? b : a) + " is no cloud of a surface (points with radii are particles: "
                                                 "`meniscus fit` makes them a surface)"));
    const bool open = first.has_value() || second.has_value();
    const auto field = [&](std::optional<pointset::Solid>& points, const std::string& path) {
      return points ? pointset::field_of(*points) : scene::SurfaceSource({path}, {}, control).open({}, control).field;
    };
    auto fa = field(first, a), fb = field(second, b);
    session.timing("read");
    join_fields(std::move(fa), std::move(fb), open, session, control);
  }
  control.progress(1);
}

}  // namespace

void add_boolean(CLI::App& app, Session& session) {
  CLI::App* verb = app.add_subcommand(
      "boolean",
      "Join, intersect or subtract two solids.\n\n"
      "Example: meniscus boolean difference part.msurf hole.ply -o drilled.msurf\n\n"
      "Two clouds (or .msurf) give points, and as .msurf a surface with sharp edges that can be joined again. With a scene, "
      "mesh or level set among them the result is a mesh.");
  auto state = std::make_shared<BooleanVerb>();
  verb->add_option("operation", state->operation, "union, intersection or difference (first less second)")
      ->required()
      ->check(CLI::IsMember({"union", "intersection", "difference"}));
  verb->add_option("a", state->a, "first solid")->required();
  verb->add_option("b", state->b, "second solid")->required();
  verb->add_flag("--blend", state->blend, "fit all points as one cloud: a soft edge instead of a sharp one");
  verb->add_flag("--mesh", state->mesh, "write a mesh even of two clouds");
  verb->add_option("--voxel", state->voxel, "cell size of a mesh, world units; default: a 128th of the diameter of both")
      ->check(CLI::PositiveNumber);
  session.add_output(*verb);
  session.add_common(*verb);
  verb->callback([state, &session] { state->run(session); });
}

}  // namespace meniscus::cli
