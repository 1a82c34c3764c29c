#include <meniscus/scene/sculpt_script.h>

#include <meniscus/base/suggest.h>
#include <meniscus/io/file_bytes.h>
#include <meniscus/io/grey_png.h>
#include <meniscus/scene/json_place.h>

#include <cmath>
#include <filesystem>
#include <map>

namespace meniscus::scene {
namespace {

using pointset::Falloff;
using pointset::Projection;
using pointset::Stroke;

constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 28;

constexpr std::string_view kTools[] = {"force", "inflate", "smooth", "flatten", "crease",
                                       "drag",  "emboss",  "refine", "undo",    "redo"};

/// The value that a word stands for; an error with a suggestion otherwise.
template <class T>
T meaning(const JsonPlace& place, const std::map<std::string, T>& words) {
  const std::string word = place.text();
  if (const auto it = words.find(word); it != words.end()) return it->second;
  std::vector<std::string_view> names;
  for (const auto& [name, value] : words) names.emplace_back(name);
  place.fail("unknown word '" + word + "'" + did_you_mean(word, names));
}

int whole(const JsonPlace& place) {
  const double v = place.number();
  if (v != std::floor(v) || std::abs(v) > 1e9) place.fail("a whole number is expected");
  return static_cast<int>(v);
}

std::vector<Vec3> path_of(const JsonPlace& place) {
  place.require_array(1);
  if (place.at(std::size_t{0}).json().is_number()) return {place.vector()};
  std::vector<Vec3> path;
  for (std::size_t i = 0; i < place.size(); ++i) path.push_back(place.at(i).vector());
  return path;
}

Falloff falloff_of(const JsonPlace& place) {
  Falloff falloff;
  if (place.json().is_array()) {
    falloff.kind = Falloff::Kind::Custom;
    for (std::size_t i = 0; i < place.size(); ++i) falloff.custom.push_back(place.at(i).number());
    return falloff;
  }
  falloff.kind = meaning<Falloff::Kind>(place, {{"gaussian", Falloff::Kind::Gaussian},
                                                {"constant", Falloff::Kind::Constant},
                                                {"spherical", Falloff::Kind::Spherical},
                                                {"smooth", Falloff::Kind::Smooth}});
  return falloff;
}

std::array<bool, 3> mirror_of(const JsonPlace& place) {
  std::array<bool, 3> mirror{};
  const std::string axes = place.text();
  for (const char c : axes) {
    if (c < 'x' || c > 'z') place.fail("mirror takes axes: \"x\", \"xy\", …");
    mirror[static_cast<std::size_t>(c - 'x')] = true;
  }
  return mirror;
}

Box region_of(const JsonPlace& place) {
  place.allow_keys({"min", "max"});
  const Box box{place.at("min").vector(), place.at("max").vector()};
  if (box.empty()) place.fail("the region is empty: min is above max");
  return box;
}

pointset::Material material_of(const JsonPlace& place) {
  place.allow_keys({"mass", "damping", "stiffness"});
  pointset::Material m;
  if (place.has("mass")) m.mass = place.at("mass").number();
  if (place.has("damping")) m.damping = place.at("damping").number();
  if (place.has("stiffness")) m.stiffness = place.at("stiffness").number();
  return m;
}

Projection projection_of(const JsonPlace& place) {
  place.allow_keys({"type", "origin", "direction", "up", "width", "height"});
  Projection p;
  p.kind = meaning<Projection::Kind>(place.at("type"), {{"planar", Projection::Kind::Planar},
                                                        {"cylindrical", Projection::Kind::Cylindrical},
                                                        {"spherical", Projection::Kind::Spherical}});
  if (p.kind != Projection::Kind::Planar) p.width = 360;
  if (p.kind == Projection::Kind::Spherical) p.height = 180;
  if (place.has("origin")) p.origin = place.at("origin").vector();
  if (place.has("direction")) p.direction = place.at("direction").vector();
  if (place.has("up")) p.up = place.at("up").vector();
  if (place.has("width")) p.width = place.at("width").number();
  if (place.has("height")) p.height = place.at("height").number();
  return p;
}

/// Images by path: strokes share them.
using Images = std::map<std::string, std::shared_ptr<const pointset::GreyImage>>;

std::shared_ptr<const pointset::GreyImage> image_of(const JsonPlace& place, Images& images) {
  const std::filesystem::path named(place.text());
  const std::string path =
      named.is_absolute() ? named.string() : (std::filesystem::path(place.file()).parent_path() / named).string();
  auto& image = images[path];
  if (!image) image = std::make_shared<const pointset::GreyImage>(io::read_grey_png(path));
  if (image->width < 2 || image->height < 2) place.fail("the image '" + path + "' has a single row or column of pixels");
  return image;
}

Stroke stroke_of(const JsonPlace& place, Images& images) {
  place.allow_keys({"tool", "label", "path", "radius", "strength", "falloff", "direction", "mirror", "region", "material",
                    "seconds", "steps", "voxels", "image", "projection", "spacing"});
  Stroke s;
  const std::string name = place.at("tool").text();
  const auto tool = pointset::tool_named(name);
  if (!tool) place.at("tool").fail("unknown tool '" + name + "'" + did_you_mean(name, kTools));
  s.tool = *tool;
  s.label = place.has("label") ? place.at("label").text() : name_of(s.tool);
  if (place.has("path")) s.path = path_of(place.at("path"));
  if (place.has("radius")) s.radius = place.at("radius").number();
  if (place.has("strength")) s.strength = place.at("strength").number();
  if (place.has("falloff")) s.falloff = falloff_of(place.at("falloff"));
  if (place.has("direction")) s.direction = place.at("direction").vector();
  if (place.has("mirror")) s.mirror = mirror_of(place.at("mirror"));
  if (place.has("region")) s.region = region_of(place.at("region"));
  if (place.has("material")) s.material = material_of(place.at("material"));
  if (place.has("seconds")) s.seconds = place.at("seconds").number();
  if (place.has("steps")) s.steps = whole(place.at("steps"));
  if (place.has("voxels")) s.voxels = whole(place.at("voxels"));
  if (place.has("image")) s.image = image_of(place.at("image"), images);
  if (place.has("projection")) s.projection = projection_of(place.at("projection"));
  if (place.has("spacing")) s.spacing = place.at("spacing").number();
  try {
    check(s);
  } catch (const InvalidInput& e) {
    place.fail(e.what());
  }
  return s;
}

SculptCommand command_of(const JsonPlace& place, Images& images) {
  place.require_object();
  SculptCommand command;
  command.where = place.path();
  const std::string tool = place.at("tool").text();
  if (tool == "undo" || tool == "redo") {
    place.allow_keys({"tool", "label"});
    command.kind = tool == "undo" ? SculptCommand::Kind::Undo : SculptCommand::Kind::Redo;
    command.stroke.label = tool;
  } else {
    command.stroke = stroke_of(place, images);
  }
  return command;
}

}  // namespace

SculptScript load_sculpt_script(const std::string& path) {
  return parse_sculpt_script(io::load_file(path, kMostBytes), path);
}

SculptScript parse_sculpt_script(std::string_view text, const std::string& path) {
  nlohmann::json json;
  try {
    json = nlohmann::json::parse(text, nullptr, true, true);
  } catch (const nlohmann::json::parse_error& e) {
    throw IoError(path, "this is not JSON: " + std::string(e.what()));
  }
  const JsonPlace root(json, "", path);
  root.allow_keys({"$schema", "format", "version", "spacing", "strokes"});
  if (root.has("format") && root.at("format").text() != "meniscus.sculpt")
    root.at("format").fail("\"meniscus.sculpt\" is expected");
  if (root.has("version") && whole(root.at("version")) != 1) root.at("version").fail("only version 1 is known");
  SculptScript script;
  if (root.has("spacing")) {
    script.spacing = root.at("spacing").number();
    if (!(*script.spacing > 0)) root.at("spacing").fail("the spacing must be above 0");
  }
  const JsonPlace list = root.at("strokes");
  list.require_array(1);
  Images images;
  for (std::size_t i = 0; i < list.size(); ++i) script.commands.push_back(command_of(list.at(i), images));
  return script;
}

}  // namespace meniscus::scene
