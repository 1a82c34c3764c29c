#include "cli.h"

#include <meniscus/io/atomic_file.h>
#include <meniscus/polygonize/polygonize.h>
#include <meniscus/scene/edit_session.h>
#include <meniscus/scene/strokes.h>

#include <fmt/format.h>

#include <cmath>
#include <memory>

namespace meniscus::cli {
namespace {

using scene::Stroke;

constexpr std::size_t kMetricPoints = 2000;

struct EditVerb {
  std::string scene;
  std::vector<std::string> drags, pins, freeze;
  std::string script;
  bool sideways = false;
  std::optional<double> time;
  std::string metric = "controls";
  std::string frames, points;
  std::size_t count = 2000;
  double fps = 24;
  std::optional<double> voxel, area, volume;

  std::vector<Stroke> strokes() const;
  void run(Session& session) const;
};

scene::Drag parse_drag(const std::string& text, bool sideways) {
  scene::Drag drag;
  std::size_t begin = 0;
  while (true) {
    const std::size_t arrow = text.find("->", begin);
    drag.path.push_back(parse_vector(text.substr(begin, arrow == std::string::npos ? arrow : arrow - begin), "--drag"));
    if (arrow == std::string::npos) break;
    begin = arrow + 2;
  }
  if (drag.path.size() < 2) throw UsageError("--drag takes \"x,y,z -> x,y,z\", not '" + text + "'");
  drag.times = scene::even_times(drag.path.size(), 1);
  drag.sideways = sideways;
  return drag;
}

std::vector<Stroke> EditVerb::strokes() const {
  if (!script.empty() && !drags.empty()) throw UsageError("give drags (--drag) or a script of strokes (--script), not both");
  if (script.empty() && drags.empty()) {
    if (area || volume) return {};
    throw UsageError("give drags (--drag), a script of strokes (--script), or an --area or --volume to reach");
  }
  if (!script.empty()) {
    if (!pins.empty() || sideways) throw UsageError("pins and sideways drags stand in the script itself");
    std::vector<Stroke> strokes = scene::read_strokes(script);
    for (Stroke& s : strokes) s.freeze.insert(s.freeze.end(), freeze.begin(), freeze.end());
    return strokes;
  }
  Stroke stroke;
  stroke.freeze = freeze;
  for (const std::string& d : drags) stroke.drags.push_back(parse_drag(d, sideways));
  for (const std::string& p : pins) stroke.pins.push_back(parse_vector(p, "--pin"));
  return {stroke};
}

/// Writes the surface as it moves: scenes or meshes, and the floaters that follow it.
class Film {
 public:
  Film(const EditVerb& verb, scene::EditSession& edit, Session& session) : verb_(verb), edit_(edit), session_(session) {
    for (const std::string* path : {&verb.frames, &verb.points}) moving_ = moving_ || io::FramePattern::parse(*path);
    if (!verb.frames.empty() && !io::FramePattern::parse(verb.frames))
      throw UsageError("--frames needs a place for the number: motion.####.ply, or .json for scenes");
    const double size = control::tight_bounds(edit.surface()).diameter();
    voxel_ = verb.voxel.value_or(std::isfinite(size) && size > 0 ? size / 128 : 1);
    if (!verb.points.empty()) edit.show_floaters(verb.count);
  }

  /// Whether strokes are walked through frame by frame.
  bool moving() const { return moving_; }

  /// Writes the next frame. `last` also writes what is written once.
  void frame(bool last, const RunControl& run) {
    ++number_;
    if (!verb_.frames.empty()) write_surface(path(verb_.frames), run);
    if (verb_.points.empty() || (!last && !io::FramePattern::parse(verb_.points))) return;
    const points::Cloud cloud = edit_.floaters() != nullptr ? edit_.floaters()->cloud(edit_.surface()) : points::Cloud();
    if (cloud.empty()) session_.warn("empty", "no surface was found", path(verb_.points));
    io::write_cloud(path(verb_.points), cloud, session_.write_options());
    session_.add_output_file(path(verb_.points), cloud, number());
  }

 private:
  std::string path(const std::string& name) const {
    const auto pattern = io::FramePattern::parse(name);
    return pattern ? pattern->path(number_) : name;
  }
  std::optional<long> number() const { return moving_ ? std::optional(number_) : std::nullopt; }

  void write_surface(const std::string& to, const RunControl& run) {
    if (to.ends_with(".json")) {
      scene::Document now = edit_.document();
      write_parameters(now, parameter_changes(now, edit_.surface().parameters()));
      io::write_file(to, now.json().dump(2) + "\n", session_.write_options());
      session_.add_output_file(to);
      return;
    }
    polygonize::PolygonizeOptions options;
    options.voxel = voxel_;
    const mesh::Mesh mesh = polygonize::polygonize(edit_.surface(), options, run).mesh;
    if (mesh.triangles.empty()) session_.warn("empty", "the surface is empty at this voxel size", to);
    io::write_mesh(to, mesh, session_.write_options());
    session_.add_output_file(to, mesh, number());
  }

  const EditVerb& verb_;
  scene::EditSession& edit_;
  Session& session_;
  bool moving_ = false;
  double voxel_ = 0;
  long number_ = 0;
};

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

/// The times at which a stroke is looked at: its frames, or where its drags change direction.
std::vector<double> stops(const Stroke& stroke, std::optional<double> fps) {
  if (!fps) return stroke.knots();
  std::vector<double> times;
  const auto frames = static_cast<long>(std::ceil(stroke.seconds() * *fps - 1e-9));
  for (long k = 1; k <= frames; ++k) times.push_back(std::min(static_cast<double>(k) / *fps, stroke.seconds()));
  return times;
}

/// Does what the stroke says to the surface. Throws if nothing can follow.
void make(const Stroke& stroke, const EditVerb& verb, scene::EditSession& edit, Film& film, bool last, Session& session,
          const RunControl& run) {
  control::DragOptions options;
  options.freeze = stroke.freeze;
  if (verb.metric == "surface") options.samples = edit.spread_points(kMetricPoints).positions;
  control::ControlSession& controls = edit.begin_stroke(options);
  for (const scene::Drag& d : stroke.drags) add_control(controls, d.path[0], d.sideways, session);
  for (const Vec3& p : stroke.pins) add_control(controls, p, false, session);

  control::StepReport report;
  const std::vector<double> times = stops(stroke, film.moving() ? std::optional(verb.fps) : std::nullopt);
  for (std::size_t k = 0; k < times.size(); ++k) {
    for (std::size_t i = 0; i < stroke.drags.size(); ++i) controls.aim(i, stroke.drags[i].at(times[k]));
    run.check();
    report = edit.run(1 / verb.fps).control;
    session.report()["control"] = block(report, controls);
    using Outcome = control::StepReport::Outcome;
    if (report.outcome == Outcome::Unchanged) throw Error("no parameter of the surface is in reach of the controls");
    const bool stopped = report.outcome != Outcome::Arrived;
    if (film.moving() || (last && (stopped || k + 1 == times.size())))
      film.frame(last && (stopped || k + 1 == times.size()), run);
    if (!stopped) continue;
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
  edit.end_stroke(stroke.label);
}

/// The surface takes an area or a volume, as an entry of the history of its own.
void reach(control::Measure what, double target, const EditVerb& verb, scene::EditSession& edit, Session& session) {
  const char* name = what == control::Measure::Area ? "area" : "volume";
  const control::GoalReport r = edit.reach(what, target, verb.freeze);
  session.report()["goal"] = {{"kind", name}, {"reached", r.reached}, {"value", r.value}, {"steps", r.steps}};
  if (!r.reached) session.warn("goal", fmt::format("the {} is {:.6g}: no shape near by has {:.6g}", name, r.value, target));
  edit.end_stroke(name);
}

void EditVerb::run(Session& session) const {
  for (const auto& goal : {area, volume})
    if (goal && !(std::isfinite(*goal) && *goal > 0)) throw UsageError("--area and --volume must be above zero");
  if (area && volume) throw UsageError("--area and --volume exclude each other");
  if (!(fps > 0)) throw UsageError("--fps must be above zero");
  if (voxel && !(*voxel > 0)) throw UsageError("--voxel must be above zero");
  if (count == 0) throw UsageError("--count must be at least 1");
  const std::vector<Stroke> list = strokes();
  const RunControl run = session.run();
  session.add_input(scene);
  if (!script.empty()) session.add_input(script);
  const scene::Document original = scene::Document::load(scene);
  scene::EditSession edit(original, run.part(0, 0.1));
  if (time) edit.surface().set_time(*time);
  session.timing("read");

  Film film(*this, edit, session);
  if (film.moving()) film.frame(false, run);
  for (std::size_t i = 0; i < list.size(); ++i) {
    make(list[i], *this, edit, film, i + 1 == list.size(), session, run);
    run.progress(0.1 + 0.9 * static_cast<double>(i + 1) / static_cast<double>(list.size()), "edit");
  }
  if (area) reach(control::Measure::Area, *area, *this, edit, session);
  if (volume) reach(control::Measure::Volume, *volume, *this, edit, session);
  session.timing("edit");

  const auto changes = scene::parameter_changes(original, edit.surface().parameters());
  nlohmann::json& values = session.report()["values"] = nlohmann::json::object();
  for (const auto& c : changes) values[c.name] = c.after;
  io::write_file(session.output(), edit.document().json().dump(2) + "\n", session.write_options());
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
  verb->add_option(
          "--metric", state->metric,
          "what counts as a small change: of the surface at the controls, or all over (surface), which spares radii; "
          "default controls")
      ->check(CLI::IsMember({"controls", "surface"}));
  verb->add_option(
      "--script", state->script,
      "strokes in JSON: {\"strokes\": [{\"seconds\": 1, \"drags\": [{\"path\": [[x,y,z], …], \"times\": [0, …], "
      "\"sideways\": false}], \"pins\": [[x,y,z], …], \"freeze\": [name, …]}, …]}");
  verb->add_option("--frames", state->frames,
                   "also write the motion: meshes (motion.####.ply) or scenes (motion.####.json); frame 1 is the start");
  verb->add_option("--fps", state->fps, "frames per second of the motion; default 24, a stroke lasts 1 s unless it says so");
  verb->add_option("--voxel", state->voxel,
                   "cell size of those meshes, world units; default: a 128th of the surface's diameter");
  verb->add_option("--points", state->points,
                   "also write floaters that follow the surface: every frame (pts.####.ply), or at the end (pts.ply)");
  verb->add_option("--count", state->count, "how many floaters to begin with; default 2000");
  verb->add_option("--area", state->area, "then change as little as possible until the surface has this area, world units²");
  verb->add_option("--volume", state->volume, "the same for the volume it encloses, world units³");
  verb->add_option("--time", state->time, "moment of a moving scene at which it is edited, seconds; default 0");
  session.add_output(*verb);
  session.add_common(*verb);
  verb->callback([state, &session] { state->run(session); });
}

}  // namespace meniscus::cli
