#include "cli.h"

#include <meniscus/mesh/validate.h>

#include <fmt/format.h>

#include <memory>

namespace meniscus::cli {
namespace {

std::string describe(const Box& box) {
  if (box.empty()) return "empty";
  return fmt::format("{:.6g},{:.6g},{:.6g} -> {:.6g},{:.6g},{:.6g}", box.min.x(), box.min.y(), box.min.z(), box.max.x(),
                     box.max.y(), box.max.z());
}

std::string describe(const Attributes& attributes) {
  std::string text;
  for (const Attribute& a : attributes)
    text += fmt::format("{}{} ({}{})", text.empty() ? "" : ", ", a.name, a.is_integer() ? "integer" : "real",
                        a.components == 1 ? "" : fmt::format(" x{}", a.components));
  return text.empty() ? "none" : text;
}

nlohmann::json names(const Attributes& attributes) {
  nlohmann::json list = nlohmann::json::array();
  for (const Attribute& a : attributes)
    list.push_back({{"name", a.name}, {"components", a.components}, {"integer", a.is_integer()}});
  return list;
}

void surface_info(const scene::SurfaceSource& source, Session& session, std::string& text, nlohmann::json& info) {
  const scene::Surface surface = source.open(std::nullopt);
  const field::Field& f = *surface.field;
  info["bounds"] = to_json(f.bounds());
  info["moving"] = f.moving();
  info["parameters"] = nlohmann::json::array();
  text += fmt::format("bounds      {}\nmoving      {}\nunknowns    {}\n", describe(f.bounds()), f.moving() ? "yes" : "no",
                      f.parameters().size());
  for (const field::Parameter& p : f.parameters()) {
    info["parameters"].push_back({{"name", p.name}, {"value", p.value}});
    if (f.parameters().size() <= 40 || session.verbose()) text += fmt::format("  {} = {:.6g}\n", p.name, p.value);
  }
}

void info(const std::string& path, Session& session) {
  session.add_input(path);
  nlohmann::json& info = session.report()["info"];
  const std::string format = io::format_of_input(path);
  std::string text = fmt::format("file        {}\n", path);
  if (format == "json" || format == "vdb") {
    const scene::SurfaceSource source({path}, {}, session.run());
    info["kind"] = source.kind_name();
    text += fmt::format("kind        {}\n", source.kind_name());
    if (const auto* d = source.document()) {
      info["fps"] = d->frames_per_second();
      info["range"] = {d->first_frame(), d->last_frame()};
      text += fmt::format("frames      {}-{} at {} per second\n", d->first_frame(), d->last_frame(), d->frames_per_second());
    }
    surface_info(source, session, text, info);
  } else {
    io::ReadReport read;
    const std::size_t frames = io::count_frames(path);
    const io::Geometry g = io::read_geometry(path, {}, &read);
    session.warn(read);
    const bool mesh = g.kind == io::Geometry::Kind::Mesh;
    const Attributes& attributes = mesh ? g.mesh.attributes : g.cloud.attributes;
    const std::size_t points = mesh ? g.mesh.positions.size() : g.cloud.size();
    const Box box = mesh ? mesh::bounds(g.mesh) : points::bounds(g.cloud);
    info = {{"kind", mesh ? "mesh" : "points"},
            {"format", read.format},
            {"points", points},
            {"frames", frames},
            {"bbox", to_json(box)},
            {"attributes", names(attributes)},
            {"dropped", read.dropped}};
    text += fmt::format("kind        {} ({})\npoints      {}\n", mesh ? "mesh" : "points", read.format, grouped(points));
    if (frames > 1) text += fmt::format("frames      {}\n", frames);
    if (mesh) {
      const mesh::Audit audit = mesh::validate(g.mesh);
      info["triangles"] = g.mesh.triangles.size();
      info["area"] = mesh::area(g.mesh);
      info["volume"] = mesh::volume(g.mesh);
      text += fmt::format("triangles   {}\narea        {:.6g}\nvolume      {:.6g}\nstate       {}\n",
                          grouped(g.mesh.triangles.size()), mesh::area(g.mesh), mesh::volume(g.mesh), mesh::summary(audit));
    }
    text += fmt::format("bounds      {}\nattributes  {}\n", describe(box), describe(attributes));
  }
  session.print(text);
}

}  // namespace

void add_info(CLI::App& app, Session& session) {
  CLI::App* verb = app.add_subcommand("info",
                                      "What is in a scene, mesh, cloud, particle file or level set.\n\n"
                                      "Example: meniscus info drops.lammpstrj");
  auto path = std::make_shared<std::string>();
  verb->add_option("file", *path, "the file")->required();
  session.add_common(*verb);
  verb->callback([path, &session] { info(*path, session); });
}

}  // namespace meniscus::cli
