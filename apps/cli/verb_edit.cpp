#include "cli.h"

#include <meniscus/control/drag.h>
#include <meniscus/io/atomic_file.h>
#include <meniscus/io/file_bytes.h>
#include <meniscus/scene/build_field.h>
#include <meniscus/scene/history.h>

#include <fmt/format.h>

#include <memory>

namespace meniscus::cli {
namespace {

constexpr std::uint64_t kMaxScriptBytes = std::uint64_t{1} << 28;

/// Drags that happen together, the points that hold meanwhile: one command of the document.
struct Stroke {
  struct Drag {
    std::vector<Vec3> path;  // from the surface point through all places it goes
    bool sideways = false;
  };
  std::string label;
  std::vector<Drag> drags;
  std::vector<Vec3> pins;
  std::vector<std::string> freeze;
};

struct EditVerb {
  std::string scene;
  std::vector<std::string> drags, pins, freeze;
  std::string script;
  bool sideways = false;
  std::optional<double> time;

  std::vector<Stroke> strokes() const;
  void run(Session& session) const;
};

std::vector<Vec3> parse_path(const std::string& text) {
  std::vector<Vec3> path;
  std::size_t begin = 0;
  while (true) {
    const std::size_t arrow = text.find("->", begin);
    path.push_back(parse_vector(text.substr(begin, arrow == std::string::npos ? arrow : arrow - begin), "--drag"));
    if (arrow == std::string::npos) break;
    begin = arrow + 2;
  }
  if (path.size() < 2) throw UsageError("--drag takes \"x,y,z -> x,y,z\", not '" + text + "'");
  return path;
}

std::vector<Vec3> read_points(const scene::JsonPlace& list, std::size_t least) {
  list.require_array(least);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < list.size(); ++i) points.push_back(list.at(i).vector());
  return points;
}

Stroke read_stroke(const scene::JsonPlace& place) {
  place.require_object();
  place.allow_keys({"label", "drags", "pins", "freeze"});
  Stroke stroke;
  stroke.label = place.has("label") ? place.at("label").text() : "drag";
  const scene::JsonPlace drags = place.at("drags");
  drags.require_array(1);
  for (std::size_t i = 0; i < drags.size(); ++i) {
    const scene::JsonPlace drag = drags.at(i);
    drag.require_object();
    drag.allow_keys({"path", "sideways"});
    bool sideways = false;
    if (drag.has("sideways")) {
      if (!drag.at("sideways").json().is_boolean()) drag.at("sideways").fail("true or false is expected");
      sideways = drag.at("sideways").json().get<bool>();
    }
    stroke.drags.push_back({read_points(drag.at("path"), 2), sideways});
  }
  if (place.has("pins")) stroke.pins = read_points(place.at("pins"), 0);
  if (place.has("freeze")) {
    place.at("freeze").require_array();
    for (std::size_t i = 0; i < place.at("freeze").size(); ++i) stroke.freeze.push_back(place.at("freeze").at(i).text());
  }
  return stroke;
}

std::vector<Stroke> read_script(const std::string& path) {
  nlohmann::json json;
  try {
    json = nlohmann::json::parse(io::load_file(path, kMaxScriptBytes), nullptr, true, true);
  } catch (const nlohmann::json::parse_error& e) {
    throw IoError(path, "this is not JSON: " + std::string(e.what()));
  }
  const scene::JsonPlace root(json, "", path);
  root.require_object();
  root.allow_keys({"strokes"});
  const scene::JsonPlace list = root.at("strokes");
  list.require_array(1);
  std::vector<Stroke> strokes;
  for (std::size_t i = 0; i < list.size(); ++i) strokes.push_back(read_stroke(list.at(i)));
  return strokes;
}

std::vector<Stroke> EditVerb::strokes() const {
  if (script.empty() == drags.empty()) throw UsageError("give drags (--drag) or a script of strokes (--script)");
  if (!script.empty()) {
    if (!pins.empty() || sideways) throw UsageError("pins and sideways drags stand in the script itself");
    std::vector<Stroke> strokes = read_script(script);
    for (Stroke& s : strokes) s.freeze.insert(s.freeze.end(), freeze.begin(), freeze.end());
    return strokes;
  }
  Stroke stroke;
  stroke.label = "drag";
  stroke.freeze = freeze;
  for (const std::string& d : drags) stroke.drags.push_back({parse_path(d), sideways});
  for (const std::string& p : pins) stroke.pins.push_back(parse_vector(p, "--pin"));
  return {stroke};
}

std::string place(const Vec3& p) { return fmt::format("{:.6g},{:.6g},{:.6g}", p.x(), p.y(), p.z()); }

void add_control(control::ControlSession& controls, const Vec3& point, bool sideways, Session& session) {
  const control::Placed placed = controls.add(point, sideways);
  if (placed.moved > 1e-3 * controls.length())
    session.warn("off_surface",
                 fmt::format("the point {} lies {:.3g} off the surface and was moved onto it", place(point), placed.moved));
}

nlohmann::json block(const control::StepReport& r, const control::ControlSession& controls) {
  return {{"count", controls.controls().size()},
          {"parameters", r.parameters},
          {"rank", r.rank},
          {"residuals", r.residual},
          {"conflicts", r.conflicts},
          {"slipped", r.slipped},
          {"condition", r.condition},
          {"at_bound", r.at_bound},
          {"status", control::name(r.status)},
          {"outcome", control::name(r.outcome)}};
}

/// Does what the stroke says to the field. Throws if nothing can follow.
void make(const Stroke& stroke, field::Field& surface, Session& session, const RunControl& run) {
  control::DragOptions options;
  options.freeze = stroke.freeze;
  control::ControlSession controls(surface, options);
  std::size_t longest = 0;
  for (const Stroke::Drag& d : stroke.drags) {
    add_control(controls, d.path[0], d.sideways, session);
    longest = std::max(longest, d.path.size());
  }
  for (const Vec3& p : stroke.pins) add_control(controls, p, false, session);

  control::StepReport report;
  for (std::size_t leg = 1; leg < longest; ++leg) {
    for (std::size_t i = 0; i < stroke.drags.size(); ++i)
      controls.aim(i, stroke.drags[i].path[std::min(leg, stroke.drags[i].path.size() - 1)]);
    run.check();
    report = controls.run();
    session.report()["control"] = block(report, controls);
    using Outcome = control::StepReport::Outcome;
    if (report.outcome == Outcome::Unchanged) throw Error("no parameter of the surface is in reach of the controls");
    if (report.outcome == Outcome::Arrived) continue;
    session.warn("stopped", fmt::format("the drag stopped {:.3g} short of its target: no shape near by holds all controls",
                                        report.away));
    break;
  }
  for (const std::size_t i : report.conflicts)
    session.warn("conflict", fmt::format("the surface misses the control at {} by {:.3g}",
                                         place(controls.controls()[i].position), report.residual[i]));
  for (const std::size_t i : report.slipped)
    session.warn("slipped",
                 "the surface's material could not follow the control at " + place(controls.controls()[i].position));
}

void EditVerb::run(Session& session) const {
  const std::vector<Stroke> list = strokes();
  const RunControl run = session.run();
  session.add_input(scene);
  scene::Document document = scene::Document::load(scene);
  const auto surface = scene::build_field(document, run.part(0, 0.1));
  if (time) surface->set_time(*time);
  session.timing("read");

  const scene::Document original = document;
  scene::History history;
  for (std::size_t i = 0; i < list.size(); ++i) {
    make(list[i], *surface, session, run);
    history.apply(document, {list[i].label, scene::parameter_changes(document, surface->parameters())});
    run.progress(0.1 + 0.9 * static_cast<double>(i + 1) / static_cast<double>(list.size()), "edit");
  }
  session.timing("edit");

  const auto changes = scene::parameter_changes(original, surface->parameters());
  nlohmann::json& values = session.report()["values"] = nlohmann::json::object();
  for (const auto& c : changes) values[c.name] = c.after;
  io::write_file(session.output(), document.json().dump(2) + "\n", session.write_options());
  session.add_output_file(session.output());
  session.timing("write");
  session.say(fmt::format("{}: {} changed by {}", session.output(),
                          changes.size() == 1 ? "1 parameter" : grouped(changes.size()) + " parameters",
                          list.size() == 1 ? "1 stroke" : grouped(list.size()) + " strokes"));
  run.progress(1);
}

}  // namespace

void add_edit(CLI::App& app, Session& session) {
  CLI::App* verb = app.add_subcommand("edit",
                                      "Move points of a scene's surface; the parameters follow.\n\n"
                                      "Example: meniscus edit blobs.json --drag \"0,0.6,0 -> 0,0.9,0\" -o taller.json");
  auto state = std::make_shared<EditVerb>();
  verb->add_option("scene", state->scene, "scene (.json)")->required();
  verb->add_option("--drag", state->drags,
                   "\"x,y,z -> x,y,z\": a surface point and where it goes, over several places if given");
  verb->add_option("--pin", state->pins, "\"x,y,z\": a surface point that stays");
  verb->add_option("--freeze", state->freeze, "a parameter that stays, or all below a name: items[2], items[0].radius");
  verb->add_flag("--sideways", state->sideways, "drags take along the part they hold, not only the surface");
  verb->add_option("--script", state->script,
                   "strokes in JSON: {\"strokes\": [{\"drags\": [{\"path\": [[x,y,z], …], \"sideways\": false}], "
                   "\"pins\": [[x,y,z], …], \"freeze\": [name, …]}, …]}");
  verb->add_option("--time", state->time, "moment of a moving scene at which it is edited, seconds; default 0");
  session.add_output(*verb);
  session.add_common(*verb);
  verb->callback([state, &session] { state->run(session); });
}

}  // namespace meniscus::cli
