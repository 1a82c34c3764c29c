#include "cli.h"

#include <meniscus/io/geometry.h>
#include <meniscus/mesh/validate.h>
#include <meniscus/polygonize/polygonize.h>

#include <fmt/format.h>

#include <memory>

namespace meniscus::cli {
namespace {

struct MeshVerb {
  SurfaceInput input;
  std::optional<double> voxel;
  std::string box;

  void run(Session& session) const;
  polygonize::PolygonizeOptions options(const scene::Surface& surface) const;
};

polygonize::PolygonizeOptions MeshVerb::options(const scene::Surface& surface) const {
  polygonize::PolygonizeOptions o;
  if (!box.empty()) o.box = parse_box(box);
  if (!o.box && !surface.field->bounds().finite() && !surface.field->bounds().empty())
    throw UsageError("the surface is unbounded: give --box \"x,y,z -> x,y,z\"");
  o.voxel = voxel ? *voxel : o.box ? o.box->diameter() / 128 : surface.voxel;
  o.open = surface.open;
  if (!(o.voxel > 0)) o.voxel = 1;  // an empty surface: nothing will be sampled
  return o;
}

nlohmann::json block(const mesh::Mesh& mesh, const mesh::Audit& audit) {
  return {{"vertices", audit.vertices},   {"triangles", audit.triangles},   {"area", mesh::area(mesh)},
          {"volume", mesh::volume(mesh)}, {"components", audit.components}, {"euler", audit.euler},
          {"closed", audit.closed()},     {"manifold", audit.manifold()}};
}

void MeshVerb::run(Session& session) const {
  if (voxel && !(*voxel > 0)) throw UsageError("--voxel must be above zero");
  const RunControl control = session.run();
  const scene::SurfaceSource source = input.open(session, control.part(0, 0.1));
  const auto paths = output_paths(session.output(), source.frames());
  session.timing("read");
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const double share = 0.9 / static_cast<double>(paths.size());
    const RunControl part = control.part(0.1 + share * static_cast<double>(i), 0.1 + share * static_cast<double>(i + 1));
    const auto frame = source.frames().empty() ? std::nullopt : std::optional<long>(source.frames()[i]);
    const scene::Surface surface = source.open(frame, part);
    const auto result = polygonize::polygonize(*surface.field, options(surface), part);
    session.timing("polygonize");
    for (const std::string& w : result.report.warnings) session.warn("polygonize", w, paths[i]);
    if (result.mesh.triangles.empty()) session.warn("empty", "the surface is empty at this voxel size", paths[i]);
    io::write_mesh(paths[i], result.mesh, session.write_options());
    session.timing("write");
    const mesh::Audit audit = mesh::validate(result.mesh);
    session.report()["mesh"] = block(result.mesh, audit);
    session.add_output_file(paths[i], result.mesh, frame);
    session.say(fmt::format("{}: {} vertices, {} triangles, {}", paths[i], grouped(audit.vertices), grouped(audit.triangles),
                            audit.components == 1 ? "1 component" : grouped(audit.components) + " components"));
    session.timing("check");
  }
  control.progress(1);
}

}  // namespace

void add_mesh(CLI::App& app, Session& session) {
  CLI::App* verb = app.add_subcommand("mesh",
                                      "Polygonise any surface: closed, oriented, manifold.\n\n"
                                      "Example: meniscus mesh drops.ply --radius 0.8 --voxel 0.25 -o drops.obj");
  auto state = std::make_shared<MeshVerb>();
  state->input.add_to(*verb);
  verb->add_option("--voxel", state->voxel,
                   "cell size, world units; default: a 128th of the surface's diameter, half the radius of particles");
  verb->add_option("--box", state->box, "\"x,y,z -> x,y,z\": where to mesh; default: the surface's own bounds");
  session.add_output(*verb);
  session.add_common(*verb);
  verb->callback([state, &session] { state->run(session); });
}

}  // namespace meniscus::cli
