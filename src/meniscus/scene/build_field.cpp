#include <meniscus/base/suggest.h>
#include <meniscus/field/blobs.h>
#include <meniscus/field/combine.h>
#include <meniscus/field/expression.h>
#include <meniscus/field/primitives.h>
#include <meniscus/field/transform.h>
#include <meniscus/scene/build_field.h>
#include <meniscus/scene/file_field.h>
#include <meniscus/scene/number.h>
#include <meniscus/scene/point_surface.h>

#include <algorithm>
#include <cctype>
#include <optional>
#include <string_view>

namespace meniscus::scene {
namespace {

using field::Field;
using FieldPtr = std::unique_ptr<Field>;

constexpr int kMaxDepth = 200;  // of nested nodes: beyond, a scene is broken or hostile

/// Builds nodes; knows the document and how deep it is.
class Builder {
 public:
  Builder(const Document& document, const RunControl& run) : document_(document), run_(run) {
    if (document.json().contains("params")) params_ = &document.json()["params"];
  }

  FieldPtr node(const JsonPlace& place, int depth) const;

 private:
  struct Context {
    const JsonPlace& place;
    NumberReader numbers;
    int depth;
  };
  struct Type {
    std::string_view name;
    FieldPtr (Builder::*build)(const Context&) const;
  };
  static const std::vector<Type>& types();

  field::Inputs inputs(const Context& c) const;
  FieldPtr input(const Context& c) const { return node(c.place.at("input"), c.depth + 1); }
  std::string file(const Context& c) const { return document_.resolve(c.place.at("file").text()); }

  FieldPtr blobs(const Context& c) const;
  FieldPtr segments(const Context& c) const;
  FieldPtr expression(const Context& c) const;
  FieldPtr mesh(const Context& c) const;
  FieldPtr particles(const Context& c) const;

  FieldPtr grid(const Context& c) const {
    c.place.allow_keys({"type", "id", "freeze", "file"});
    return field_from_grid(file(c), run_);
  }
  FieldPtr points(const Context& c) const {
    c.place.allow_keys({"type", "id", "freeze", "file"});
    return pointset::field_of(read_point_surface(file(c), {}, nullptr, run_));
  }
  FieldPtr sphere(const Context& c) const {
    c.place.allow_keys({"type", "id", "freeze", "center", "radius"});
    return field::sphere(c.numbers.vector_member(c.place, "center", ""), c.numbers.member(c.place, "radius", ""));
  }
  FieldPtr box(const Context& c) const {
    c.place.allow_keys({"type", "id", "freeze", "center", "size"});
    return field::box(c.numbers.vector_member(c.place, "center", ""), c.numbers.vector_member(c.place, "size", ""));
  }
  FieldPtr torus(const Context& c) const {
    c.place.allow_keys({"type", "id", "freeze", "center", "axis", "major", "minor"});
    return field::torus(c.numbers.vector_member(c.place, "center", ""),
                        c.numbers.vector_member(c.place, "axis", "", Vec3(0, 1, 0)), c.numbers.member(c.place, "major", ""),
                        c.numbers.member(c.place, "minor", ""));
  }
  FieldPtr capsule(const Context& c) const {
    c.place.allow_keys({"type", "id", "freeze", "a", "b", "radius"});
    return field::capsule(c.numbers.vector_member(c.place, "a", ""), c.numbers.vector_member(c.place, "b", ""),
                          c.numbers.member(c.place, "radius", ""));
  }
  FieldPtr plane(const Context& c) const {
    c.place.allow_keys({"type", "id", "freeze", "point", "normal"});
    return field::plane(c.numbers.vector_member(c.place, "point", ""), c.numbers.vector_member(c.place, "normal", ""));
  }
  FieldPtr ellipsoid(const Context& c) const {
    c.place.allow_keys({"type", "id", "freeze", "center", "radii"});
    return field::ellipsoid(c.numbers.vector_member(c.place, "center", ""), c.numbers.vector_member(c.place, "radii", ""));
  }
  FieldPtr set_union(const Context& c) const {
    c.place.allow_keys({"type", "id", "freeze", "inputs"});
    return field::set_union(inputs(c));
  }
  FieldPtr set_intersection(const Context& c) const {
    c.place.allow_keys({"type", "id", "freeze", "inputs"});
    return field::set_intersection(inputs(c));
  }
  FieldPtr set_difference(const Context& c) const {
    c.place.allow_keys({"type", "id", "freeze", "inputs"});
    return field::set_difference(inputs(c));
  }
  FieldPtr blend(const Context& c) const {
    c.place.allow_keys({"type", "id", "freeze", "inputs", "k"});
    return field::blend(inputs(c), c.numbers.member(c.place, "k", ""));
  }
  FieldPtr offset(const Context& c) const {
    c.place.allow_keys({"type", "id", "freeze", "input", "distance"});
    return field::offset(input(c), c.numbers.member(c.place, "distance", ""));
  }
  FieldPtr shell(const Context& c) const {
    c.place.allow_keys({"type", "id", "freeze", "input", "thickness"});
    return field::shell(input(c), c.numbers.member(c.place, "thickness", ""));
  }
  FieldPtr transform(const Context& c) const {
    c.place.allow_keys({"type", "id", "freeze", "input", "translate", "rotate", "scale"});
    return field::transform(input(c), c.numbers.vector_member(c.place, "translate", "", Vec3::Zero()),
                            c.numbers.vector_member(c.place, "rotate", "", Vec3::Zero()),
                            c.numbers.member(c.place, "scale", "", 1));
  }

  const Document& document_;
  const RunControl& run_;
  const nlohmann::json* params_ = nullptr;
};

const std::vector<Builder::Type>& Builder::types() {
  static const std::vector<Type> kTypes{{"blobs", &Builder::blobs},
                                        {"segments", &Builder::segments},
                                        {"sphere", &Builder::sphere},
                                        {"box", &Builder::box},
                                        {"torus", &Builder::torus},
                                        {"capsule", &Builder::capsule},
                                        {"plane", &Builder::plane},
                                        {"ellipsoid", &Builder::ellipsoid},
                                        {"expression", &Builder::expression},
                                        {"mesh", &Builder::mesh},
                                        {"grid", &Builder::grid},
                                        {"points", &Builder::points},
                                        {"particles", &Builder::particles},
                                        {"union", &Builder::set_union},
                                        {"intersection", &Builder::set_intersection},
                                        {"difference", &Builder::set_difference},
                                        {"blend", &Builder::blend},
                                        {"offset", &Builder::offset},
                                        {"shell", &Builder::shell},
                                        {"transform", &Builder::transform}};
  return kTypes;
}

FieldPtr Builder::node(const JsonPlace& place, int depth) const {
  if (depth > kMaxDepth) place.fail("the surface is nested more than " + std::to_string(kMaxDepth) + " deep");
  place.require_object();
  const std::string type = place.at("type").text();
  const auto it = std::find_if(types().begin(), types().end(), [&](const Type& t) { return t.name == type; });
  if (it == types().end()) {
    std::vector<std::string_view> names;
    for (const Type& t : types()) names.push_back(t.name);
    place.at("type").fail("unknown surface type '" + type + "'" + did_you_mean(type, names));
  }
  if (place.has("id")) place.at("id").text();
  try {
    return (this->*it->build)({place, NumberReader(params_, place), depth});
  } catch (const InvalidInput& e) {
    place.fail(e.what());
  }
}

field::Inputs Builder::inputs(const Context& c) const {
  const JsonPlace list = c.place.at("inputs");
  list.require_array(1);
  field::Inputs fields;
  for (std::size_t i = 0; i < list.size(); ++i) fields.push_back(node(list.at(i), c.depth + 1));
  return fields;
}

field::BlobKernel kernel_of(const JsonPlace& place) {
  const std::string name = place.has("kernel") ? place.at("kernel").text() : "compact";
  if (name == "gaussian") return field::BlobKernel::Gaussian;
  if (name == "compact") return field::BlobKernel::Compact;
  const std::string_view words[] = {"gaussian", "compact"};
  place.at("kernel").fail("'" + name + "' is neither gaussian nor compact" + did_you_mean(name, words));
}

/// The constant of a blob sum: "bias" for Gaussians, "threshold" for compact blobs; both words are understood.
field::Number bias_of(const JsonPlace& place, const NumberReader& numbers) {
  if (place.has("bias") && place.has("threshold")) place.fail("'bias' and 'threshold' are the same: give one");
  return numbers.member(place, place.has("threshold") ? "threshold" : "bias", "");
}

FieldPtr Builder::blobs(const Context& c) const {
  c.place.allow_keys({"type", "id", "freeze", "kernel", "bias", "threshold", "items"});
  const JsonPlace list = c.place.at("items");
  list.require_array();
  std::vector<field::Blob> items;
  items.reserve(list.size());
  for (std::size_t i = 0; i < list.size(); ++i) {
    const JsonPlace item = list.at(i);
    item.allow_keys({"center", "radius", "weight"});
    const std::string prefix = "items[" + std::to_string(i) + "].";
    items.push_back({c.numbers.vector_member(item, "center", prefix), c.numbers.member(item, "radius", prefix),
                     c.numbers.member(item, "weight", prefix, 1)});
  }
  return field::blobs(kernel_of(c.place), bias_of(c.place, c.numbers), items);
}

FieldPtr Builder::segments(const Context& c) const {
  c.place.allow_keys({"type", "id", "freeze", "kernel", "bias", "threshold", "items"});
  const JsonPlace list = c.place.at("items");
  list.require_array();
  std::vector<field::SegmentBlob> items;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const JsonPlace item = list.at(i);
    item.allow_keys({"a", "b", "radius", "weight"});
    const std::string prefix = "items[" + std::to_string(i) + "].";
    items.push_back({c.numbers.vector_member(item, "a", prefix), c.numbers.vector_member(item, "b", prefix),
                     c.numbers.member(item, "radius", prefix), c.numbers.member(item, "weight", prefix, 1)});
  }
  return field::segments(kernel_of(c.place), bias_of(c.place, c.numbers), items);
}

/// Whether `name` stands in `formula` as a word of its own.
bool names(const std::string& formula, const std::string& name) {
  const auto letter = [](char ch) { return std::isalnum(static_cast<unsigned char>(ch)) != 0 || ch == '_'; };
  for (std::size_t at = formula.find(name); at != std::string::npos; at = formula.find(name, at + 1)) {
    const std::size_t end = at + name.size();
    if ((at == 0 || !letter(formula[at - 1])) && (end == formula.size() || !letter(formula[end]))) return true;
  }
  return false;
}

FieldPtr Builder::expression(const Context& c) const {
  c.place.allow_keys({"type", "id", "freeze", "f", "bounds"});
  std::optional<Box> bounds;
  if (c.place.has("bounds")) {
    const JsonPlace b = c.place.at("bounds");
    b.require_array(2);
    bounds = Box{b.at(std::size_t{0}).vector(), b.at(std::size_t{1}).vector()};
    if (bounds->empty()) b.fail("the box is empty: [[min x, y, z], [max x, y, z]] is expected");
  }
  // The parameters of the scene that the formula names are its unknowns.
  const std::string formula = c.place.at("f").text();
  std::vector<std::pair<std::string, field::Number>> parameters;
  if (params_ != nullptr)
    for (const auto& [name, value] : params_->items()) {
      if (!names(formula, name)) continue;
      const nlohmann::json reference{{"param", name}};
      parameters.emplace_back(name, c.numbers.number({reference, c.place.path(), c.place.file()}, name));
    }
  const JsonPlace f = c.place.at("f");
  try {
    return std::make_unique<field::Expression>(formula, parameters, bounds);
  } catch (const InvalidInput& e) {
    f.fail(e.what());
  }
}

FieldPtr Builder::mesh(const Context& c) const {
  c.place.allow_keys({"type", "id", "freeze", "file", "voxel"});
  std::optional<double> voxel;
  if (c.place.has("voxel")) voxel = c.place.at("voxel").number();
  return field_from_mesh(file(c), voxel, run_);
}

FieldPtr Builder::particles(const Context& c) const {
  c.place.allow_keys({"type", "id", "freeze", "file", "radius", "frame"});
  ParticleFieldOptions options;
  if (c.place.has("radius")) options.radius = c.place.at("radius").number();
  if (c.place.has("frame")) {
    const double frame = c.place.at("frame").number();
    if (frame < 0 || frame != static_cast<double>(static_cast<std::size_t>(frame)))
      c.place.at("frame").fail("a frame index 0, 1, … is expected");
    options.frame = static_cast<std::size_t>(frame);
  }
  return field_from_particles(file(c), options, run_);
}

}  // namespace

std::unique_ptr<field::Field> build_field(const Document& document, const RunControl& run) {
  return Builder(document, run).node(document.root().at("surface"), 0);
}

}  // namespace meniscus::scene
