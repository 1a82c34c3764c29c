#include "cli.h"

#include <meniscus/io/atomic_file.h>
#include <meniscus/io/msurf.h>
#include <meniscus/polygonize/polygonize.h>
#include <meniscus/render/png.h>
#include <meniscus/render/render.h>
#include <meniscus/scene/point_surface.h>
#include <meniscus/scene/upsampled_view.h>

#include <fmt/format.h>

#include <cstdio>
#include <memory>

namespace meniscus::cli {
namespace {

struct RenderVerb {
  std::vector<std::string> files;
  std::string frames;
  std::string size = "960x720";
  std::string camera;
  std::string view;
  std::string up;
  double fov = 30;
  int samples = 32;
  double shutter = 0;
  double fps = 24;
  double time = 0;
  std::optional<double> voxel;
  bool discs = false;
  bool spheres = false;
  double upsample = 0;  // pixels between points; 0: not at all
  std::size_t most_points = scene::ViewSampling().most;
  std::optional<double> radius;
  std::string color_by;
  std::string range;
  bool diverging = false;
  std::string material = "auto";
  bool wireframe = false;
  bool flat = false;
  bool transparent = false;
  bool no_ground = false;
  bool no_legend = false;
  std::optional<int> sheet;

  void run(Session& session);

 private:
  /// What stands before the camera. The clouds of `solids` are those of their points as they are, for the camera to frame;
  /// upsample_clouds() puts denser ones in their places.
  struct Shot {
    render::Scene scene;
    std::vector<std::pair<std::size_t, pointset::Solid>> solids;  // and which of the scene's clouds are theirs
  };

  void parse();
  Shot shot_at(std::optional<long> frame, Session& session, const RunControl& run) const;
  render::Material material_or(const render::Material& otherwise) const;
  void add_file(const std::string& path, const io::Geometry& geometry, render::Scene& scene) const;
  void add_point_surface(pointset::Solid solid, Shot& shot) const;
  void add_surface(const std::string& path, std::optional<long> frame, const RunControl& run, render::Scene& scene) const;
  void color(render::Scene& scene) const;
  void upsample_clouds(Shot& shot, const render::Camera& eye, Session& session, const RunControl& run) const;
  render::Camera camera_for(const render::Scene& first, const Box& bounds, bool moving) const;
  std::vector<long> frame_list() const;
  void write(const std::string& path, const render::Image& image, Session& session) const;

  render::RenderOptions options_;
  render::View view_;
  std::vector<io::ParticleSequence> sequences_;  // one per input that is a sequence
};

std::pair<int, int> parse_size(const std::string& text) {
  int w = 0, h = 0;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &w, &h, &rest) != 2 || w < 1 || h < 1 || w > 32768 || h > 32768)
    throw UsageError("--size takes WIDTHxHEIGHT in pixels, such as 960x720, not '" + text + "'");
  return {w, h};
}

void RenderVerb::parse() {
  const auto [w, h] = parse_size(size);
  options_.width = w;
  options_.height = h;
  options_.samples = samples;
  options_.shutter = shutter;
  options_.fps = fps;
  options_.transparent = transparent;
  options_.legend = !no_legend;
  if (flat) options_.shading = render::Shading::Flat;
  view_.aspect = static_cast<double>(w) / h;
  view_.fov = fov;
  if (!view.empty()) view_.direction = parse_vector(view, "--view");
  if (!up.empty()) view_.up = parse_vector(up, "--up");
}

std::vector<long> RenderVerb::frame_list() const {
  if (!sequences_.empty()) return sequences_.front().frames();
  if (!frames.empty()) return io::parse_frames(frames);
  return {};
}

render::Material RenderVerb::material_or(const render::Material& otherwise) const {
  if (material == "clay") return render::Material::clay();
  if (material == "plaster") return render::Material::plaster();
  if (material == "liquid") return render::Material::liquid();
  return otherwise;
}

void RenderVerb::add_file(const std::string& path, const io::Geometry& geometry, render::Scene& scene) const {
  if (geometry.kind == io::Geometry::Kind::Mesh && !discs && !spheres) {
    if (geometry.mesh.triangles.empty() && geometry.mesh.positions.empty()) return;
    scene.meshes.push_back({geometry.mesh, material_or(render::Material::clay()), !flat, wireframe});
    return;
  }
  render::CloudItem item;
  item.cloud = geometry.kind == io::Geometry::Kind::Mesh ? points::Cloud{geometry.mesh.positions, geometry.mesh.attributes}
                                                         : geometry.cloud;
  if (item.cloud.empty()) return;
  if (discs && !item.cloud.attributes.has(attribute::kNormal))
    throw IoError(path, "discs need normals, and the points have none; leave --discs out to draw spheres");
  item.material = material_or(render::Material::liquid());
  item.radius = radius;
  item.spheres = spheres;
  scene.clouds.push_back(std::move(item));
}

void RenderVerb::add_surface(const std::string& path, std::optional<long> frame, const RunControl& run,
                             render::Scene& scene) const {
  scene::SourceOptions source;
  source.time = time;
  source.fps = fps;
  const scene::SurfaceSource s({path}, source, run);
  const scene::Surface surface = s.open(s.kind() == scene::SurfaceSource::Kind::Scene ? frame : std::nullopt, run);
  polygonize::PolygonizeOptions o;
  o.voxel = voxel.value_or(surface.voxel);
  o.open = surface.open;
  if (!(o.voxel > 0)) throw IoError(path, "the surface is unbounded or empty: mesh it first (meniscus mesh --box …)");
  io::Geometry g;
  g.kind = io::Geometry::Kind::Mesh;
  g.mesh = polygonize::polygonize(*surface.field, o, run).mesh;
  add_file(path, g, scene);
}

void RenderVerb::add_point_surface(pointset::Solid solid, Shot& shot) const {
  render::CloudItem item;
  item.cloud = pointset::points_of(solid);
  item.material = material_or(render::Material::clay());
  item.rims = false;
  shot.solids.emplace_back(shot.scene.clouds.size(), std::move(solid));
  shot.scene.clouds.push_back(std::move(item));
}

void RenderVerb::upsample_clouds(Shot& shot, const render::Camera& eye, Session& session, const RunControl& run) const {
  for (auto& [slot, solid] : shot.solids) {
    pointset::UpsampleReport report;
    points::Cloud& cloud = shot.scene.clouds[slot].cloud;
    cloud = scene::upsampled_for(solid, eye, options_.width, options_.height, {upsample, most_points}, &report, run);
    session.say(fmt::format("{} points drawn", cloud.size()));
    if (report.coarser > 1)
      session.warn("coarser", fmt::format("points stand {:.2g} pixels apart, or there would be more than {}",
                                          report.coarser * upsample, most_points));
  }
}

RenderVerb::Shot RenderVerb::shot_at(std::optional<long> frame, Session& session, const RunControl& run) const {
  Shot v;
  std::size_t next = 0;
  for (const std::string& path : files) {
    const std::string format = io::format_of_input(path);
    if (format == "json" || format == "vdb" || (format == "msurf" && !discs && !spheres && upsample == 0)) {
      add_surface(path, frame, run, v.scene);
      continue;
    }
    const bool is_sequence = io::FramePattern::parse(path) || io::count_frames(path) > 1;
    if (upsample > 0 && format == "msurf") {
      add_point_surface(io::read_msurf(path), v);
      continue;
    }
    io::ReadReport read;
    const io::Geometry g =
        is_sequence ? sequences_[next++].read_geometry(*frame, &read) : io::read_geometry(path, {}, &read);
    session.warn(read);
    if (upsample > 0)
      add_point_surface(scene::point_surface(scene::points_of(g), path, {}, nullptr, run), v);
    else
      add_file(path, g, v.scene);
  }
  color(v.scene);
  v.scene.ground.visible = !no_ground;
  return v;
}

void RenderVerb::color(render::Scene& scene) const {
  if (color_by.empty()) return;
  scene.color_by = render::ColorBy{color_by, diverging ? render::ColorMap::Diverging : render::ColorMap::Sequential, {}, {}};
  if (range.empty()) return;
  const auto comma = range.find(',');
  double lo = 0, hi = 0;
  if (comma == std::string::npos || !CLI::detail::lexical_cast(range.substr(0, comma), lo) ||
      !CLI::detail::lexical_cast(range.substr(comma + 1), hi) || !(lo < hi))
    throw UsageError("--range takes LOW,HIGH, not '" + range + "'");
  scene.color_by->min = lo;
  scene.color_by->max = hi;
}

render::Camera RenderVerb::camera_for(const render::Scene& first, const Box& bounds, bool moving) const {
  if (!camera.empty()) {
    const auto arrow = camera.find("->");
    if (arrow == std::string::npos)
      throw UsageError("--camera takes \"x,y,z -> x,y,z\": where it stands and what it looks at");
    render::Camera c;
    c.position = parse_vector(camera.substr(0, arrow), "--camera");
    c.target = parse_vector(camera.substr(arrow + 2), "--camera");
    c.up = view_.up;
    c.fov = fov;
    return c;
  }
  return moving ? render::frame(bounds, view_) : render::frame(first, view_);
}

void RenderVerb::write(const std::string& path, const render::Image& image, Session& session) const {
  const auto options = session.write_options();
  const render::PngText texts[] = {{"Software", std::string("meniscus ") + MENISCUS_VERSION},
                                   {"Command", options.comments.front()}};
  const auto bytes = render::encode_png(image, texts);
  io::write_file(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()}, options);
  session.add_output_file(path);
  session.say(fmt::format("{}: {} x {}", path, image.width(), image.height()));
}

void RenderVerb::run(Session& session) {
  parse();
  const RunControl control = session.run();
  io::SequenceOptions options;
  if (!frames.empty()) options.frames = io::parse_frames(frames);
  for (const std::string& f : files) {
    session.add_input(f);
    const std::string format = io::format_of_input(f);
    if (format != "json" && format != "vdb" && format != "msurf" && (io::FramePattern::parse(f) || io::count_frames(f) > 1))
      sequences_.emplace_back(std::vector<std::string>{f}, options);
  }
  const std::vector<long> list = frame_list();
  const std::vector<std::string> paths =
      sheet ? std::vector<std::string>{session.output()} : output_paths(session.output(), list);
  const std::size_t count = std::max<std::size_t>(1, list.size());
  const auto frame = [&](std::size_t i) { return list.empty() ? std::nullopt : std::optional<long>(list[i]); };

  // One camera for all frames, so that only the subject moves.
  Shot first = shot_at(frame(0), session, control);
  Box bounds = render::subject_bounds(first.scene);
  for (std::size_t i = 1; i < count && camera.empty(); ++i)
    bounds.extend(render::subject_bounds(shot_at(frame(i), session, control).scene));
  if (bounds.empty()) session.warn("empty", "there is nothing to see");
  const render::Camera eye = camera_for(first.scene, bounds, count > 1);
  session.timing("read");

  std::vector<render::Image> images;
  for (std::size_t i = 0; i < count; ++i) {
    const double n = static_cast<double>(count);
    const RunControl part = control.part(static_cast<double>(i) / n, static_cast<double>(i + 1) / n);
    render::RenderReport report;
    Shot later;
    if (i > 0) later = shot_at(frame(i), session, part);
    Shot& shot = i == 0 ? first : later;
    upsample_clouds(shot, eye, session, part);
    const render::Image image = render::render(shot.scene, eye, options_, &report, part);
    session.timing("render");
    if (report.dropped_points + report.dropped_triangles > 0)
      session.warn("dropped", fmt::format("{} points and {} triangles cannot be drawn", report.dropped_points,
                                          report.dropped_triangles));
    if (sheet)
      images.push_back(image);
    else
      write(paths[i], image, session);
  }
  if (sheet) write(paths[0], render::contact_sheet(images, *sheet), session);
  control.progress(1);
}

}  // namespace

void add_render(CLI::App& app, Session& session) {
  CLI::App* verb = app.add_subcommand("render",
                                      "A picture of meshes, points and surfaces.\n\n"
                                      "Example: meniscus render skin.####.ply --shutter 0.5 -o skin.####.png");
  auto state = std::make_shared<RenderVerb>();
  verb->add_option("input", state->files,
                   "meshes, clouds, scenes, level sets, point-set surfaces (.msurf); a pattern for a sequence")
      ->required();
  verb->add_option("--frames", state->frames, "frames to draw: 1-48, 1-100x2, 5,9,12-20; default all of a sequence");
  verb->add_option("--size", state->size, "pixels, WIDTHxHEIGHT; default 960x720");
  verb->add_option("--camera", state->camera, "\"x,y,z -> x,y,z\": place and target; default: frames the subject");
  verb->add_option("--view", state->view, "x,y,z: direction from the subject to the camera; default 0.6,0.42,1");
  verb->add_option("--up", state->up, "x,y,z: which way is up; default 0,1,0");
  verb->add_option("--fov", state->fov, "vertical opening angle, degrees; default 30")->check(CLI::Range(1.0, 170.0));
  verb->add_option("--samples", state->samples, "rays per pixel; default 32")->check(CLI::Range(1, 65536));
  verb->add_option("--shutter", state->shutter, "exposure, frames: motion blur from the attribute v; default 0")
      ->check(CLI::Range(0.0, 100.0));
  verb->add_option("--fps", state->fps, "frames per second; default 24")->check(CLI::PositiveNumber);
  verb->add_option("--time", state->time, "moment of a scene, seconds; default 0");
  verb->add_option("--voxel", state->voxel, "cell size for scenes, level sets and point-set surfaces, world units")
      ->check(CLI::PositiveNumber);
  CLI::Option* disc_flag =
      verb->add_flag("--discs", state->discs, "draw points (or a mesh's vertices) as discs along their normals");
  CLI::Option* sphere_flag = verb->add_flag("--spheres", state->spheres, "draw points (or a mesh's vertices) as spheres");
  verb->add_flag(
          "--upsample{1}", state->upsample,
          "draw points with normals, .msurf too, as the smooth surface fitted to them: points are inserted until they stand "
          "a pixel apart; --upsample=P: P pixels")
      ->check(CLI::PositiveNumber)
      ->excludes(disc_flag)
      ->excludes(sphere_flag);
  verb->add_option("--most-points", state->most_points,
                   "of an input with --upsample, or they stand farther apart; default 3000000")
      ->check(CLI::PositiveNumber);
  verb->add_option("--radius", state->radius, "of discs and spheres, world units; default: their own, or half the spacing")
      ->check(CLI::PositiveNumber);
  verb->add_option("--color", state->color_by, "attribute to colour by (vectors by length); default Cd, else the material");
  verb->add_option("--range", state->range, "LOW,HIGH of the colours; default: the attribute's own");
  verb->add_flag("--diverging", state->diverging, "colours for signed values");
  verb->add_option("--material", state->material, "clay, plaster or liquid; default clay for meshes, liquid for points")
      ->check(CLI::IsMember({"auto", "clay", "plaster", "liquid"}));
  verb->add_flag("--wireframe", state->wireframe, "draw the edges of meshes");
  verb->add_flag("--flat", state->flat, "bare colours, no light");
  verb->add_flag("--transparent", state->transparent, "no backdrop");
  verb->add_flag("--no-ground", state->no_ground, "no ground plane");
  verb->add_flag("--no-legend", state->no_legend, "no colour bar");
  verb->add_option("--sheet", state->sheet, "COLUMNS: all frames tiled into one picture")->check(CLI::Range(1, 100));
  session.add_output(*verb);
  session.add_common(*verb);
  verb->callback([state, &session] { state->run(session); });
}

}  // namespace meniscus::cli
