#include "cli.h"

#include <meniscus/sample/floaters.h>
#include <meniscus/sample/integrals.h>
#include <meniscus/sample/particle_mesh.h>
#include <meniscus/sample/spread.h>

#include <fmt/format.h>

#include <cmath>
#include <memory>

namespace meniscus::cli {
namespace {

constexpr int kStepsPerFrame = 16;  // of floaters that follow a moving surface
constexpr int kSettleSteps = 400;
constexpr double kRestSpacing = 2.017;  // of floaters, in radii
constexpr double kRoom = 1.2;  // σ̂ over the radius of the wanted spacing: radii at rest lie anywhere from 0.7 σ̂ to σ̂

struct SampleVerb {
  SurfaceInput input;
  std::optional<double> spacing;
  std::optional<std::size_t> count;
  double curvature = 0;
  std::string focus;
  double focus_radius = 0;
  std::string method = "packed";
  std::optional<int> steps;
  bool fast = false;
  std::string mesh;
  std::string box;

  void run(Session& session) const;
  Box box_of(const scene::Surface& surface) const;
  sample::SpreadOptions options(const Box& where) const;
  sample::FloaterOptions floater_options(double radius, const Box& where) const;
};

/// One frame's result, whichever way it was made.
struct Sampled {
  points::Cloud cloud;
  sample::Evenness evenness;
  int steps = 0;
  std::string state;
  std::size_t quarantined = 0;
  std::size_t faults = 0;
};

Box SampleVerb::box_of(const scene::Surface& surface) const {
  if (!box.empty()) return parse_box(box);
  const Box bounds = surface.field->bounds();
  if (bounds.empty()) return bounds;
  if (!bounds.finite()) throw UsageError("the surface is unbounded: give --box \"x,y,z -> x,y,z\"");
  return bounds.padded(0.02 * bounds.diameter());
}

sample::SpreadOptions SampleVerb::options(const Box& where) const {
  sample::SpreadOptions o{.spacing = spacing, .count = count, .fast = fast};
  o.density.curvature = curvature;
  if (!focus.empty())
    o.density.focus =
        sample::Focus{parse_vector(focus, "--focus"), focus_radius > 0 ? focus_radius : 0.1 * where.diameter()};
  if (steps) o.steps = *steps;
  return o;
}

sample::FloaterOptions SampleVerb::floater_options(double radius, const Box& where) const {
  using Method = sample::FloaterOptions::Method;
  return {.radius = kRoom * radius,
          .method = method == "global" ? Method::Global : Method::Adaptive,
          .density = options(where).density};
}

/// Floaters from one seed per component, as in the paper.
Sampled from_floaters(const field::Field& field, const Box& box, const sample::FloaterOptions& options, int max_steps,
                      const RunControl& run) {
  sample::Floaters floaters(box, options, run);
  Sampled s;
  s.steps = floaters.settle(field, max_steps);
  s.cloud = floaters.cloud(field, &s.quarantined);
  s.evenness = floaters.measured(field);
  s.state = floaters.capped()      ? "population-cap"
            : floaters.size() == 0 ? "no-surface"
            : floaters.settled()   ? "equilibrium"
                                   : "step-limit";
  return s;
}

Sampled from_spread(const field::Field& field, const Box& box, const sample::SpreadOptions& options, const RunControl& run) {
  sample::Sampling s = sample::spread(field, box, options, run);
  return {std::move(s.cloud),   s.report.evenness, s.report.steps, std::string(to_string(s.report.state)),
          s.report.quarantined, s.report.faults};
}

nlohmann::json block(const Sampled& s) {
  const sample::Evenness& e = s.evenness;
  const sample::SurfaceIntegrals i = sample::integrate(s.cloud);
  return {{"count", s.cloud.size()},
          {"area", i.area.value},
          {"area_error", i.area.error},
          {"volume", i.volume.value},
          {"volume_error", i.volume.error},
          {"components", e.components},
          {"packing", e.packing},
          {"cover", e.cover},
          {"cv", e.cv},
          {"max_distance", e.max_distance},
          {"steps", s.steps},
          {"quarantined", s.quarantined},
          {"faults", s.faults},
          {"state", s.state}};
}

/// Samplings of a moving surface, each made from the one before: points are carried by the field's own rates, arranged anew,
/// and only where they have become too many or too few do some die or are born.
class Carried {
 public:
  Carried(const SampleVerb& verb, Session& session) : verb_(verb), session_(session) {}

  Sampled frame(const field::Field& field, const Box& box, double seconds_per_frame, const RunControl& run) {
    sample::SpreadOptions options = verb_.options(box);
    options.start = &carried_;
    options.next_id = next_id_;
    sample::Sampling s = sample::spread(field, box, options, run);
    next_id_ += static_cast<std::int64_t>(s.report.born);
    session_.report()["frames"].push_back({{"count", s.cloud.size()},
                                           {"born", s.report.born},
                                           {"died", s.report.died},
                                           {"packing", s.report.evenness.packing},
                                           {"cover", s.report.evenness.cover},
                                           {"cv", s.report.evenness.cv}});
    carried_ = sample::carried(field, s.cloud, seconds_per_frame, run);
    return {std::move(s.cloud),   s.report.evenness, s.report.steps, std::string(to_string(s.report.state)),
            s.report.quarantined, s.report.faults};
  }

 private:
  const SampleVerb& verb_;
  Session& session_;
  points::Cloud carried_;
  std::int64_t next_id_ = 0;
};

/// Floaters that live through the frames of a moving surface.
class Follower {
 public:
  Follower(const SampleVerb& verb, Session& session) : verb_(verb), session_(session) {}

  Sampled frame(const field::Field& field, const Box& box, double seconds_per_frame, const RunControl& run) {
    std::size_t born = 0, died = 0, lost = 0;
    if (!floaters_) {
      start(field, box, run);
      born = floaters_->size();
    } else {
      floaters_->set_box(box);
      for (int k = 0; k < kStepsPerFrame; ++k) count(floaters_->step(field), born, died, lost);
    }
    Sampled s;
    s.cloud = floaters_->cloud(field, &s.quarantined);
    s.evenness = floaters_->measured(field);
    s.steps = kStepsPerFrame;
    s.state = floaters_->capped() ? "population-cap" : s.cloud.empty() ? "no-surface" : "following";
    session_.report()["frames"].push_back({{"count", s.cloud.size()},
                                           {"born", born},
                                           {"died", died},
                                           {"lost", lost},
                                           {"packing", s.evenness.packing},
                                           {"cover", s.evenness.cover},
                                           {"cv", s.evenness.cv}});
    // The field's own rates carry the particles to the next frame.
    if (field.moving()) floaters_->step(field, seconds_per_frame);
    return s;
  }

 private:
  static void count(const sample::FloaterStep& step, std::size_t& born, std::size_t& died, std::size_t& lost) {
    born += step.born.size();
    died += step.died.size();
    lost += step.lost.size();
  }

  /// The first frame is spread evenly; its points become floaters.
  void start(const field::Field& field, const Box& box, const RunControl& run) {
    const sample::Sampling s = sample::spread(field, box, verb_.options(box), run);
    const double radius =
        (s.report.spacing > 0 ? s.report.spacing : verb_.spacing.value_or(0.05 * box.diameter())) / kRestSpacing;
    floaters_.emplace(box, verb_.floater_options(radius, box), run);
    const auto normals = s.cloud.attributes.values(attribute::kNormal, 3);
    const auto radii = s.cloud.attributes.values(attribute::kRadius, 1);
    for (std::size_t i = 0; i < s.cloud.size(); ++i)
      floaters_->add(s.cloud.positions[i], {normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]},
                     2 * radii[i] / kRestSpacing);
  }

  const SampleVerb& verb_;
  Session& session_;
  std::optional<sample::Floaters> floaters_;
};

void write_particle_mesh(Session& session, const std::string& path, const Sampled& s, const Box& box,
                         const RunControl& run) {
  sample::ParticleMeshReport report;
  const mesh::Mesh mesh = sample::particle_mesh(s.cloud, box, &report, run);
  if (report.open_edges > 0)
    session.warn("open-mesh",
                 fmt::format("{} edges have one triangle only: the spacing is too wide there", report.open_edges), path);
  io::write_mesh(path, mesh, session.write_options());
  session.add_output_file(path, mesh);
}

void SampleVerb::run(Session& session) const {
  if (spacing.has_value() == count.has_value()) throw UsageError("give either --spacing S or --count N");
  if (spacing && !(*spacing > 0)) throw UsageError("--spacing must be above zero");
  if (count && *count == 0) throw UsageError("--count must be at least 1");
  if (count && method != "packed")
    throw UsageError("--count needs --method packed: plain floaters cannot meet a count exactly");
  const RunControl control = session.run();
  const scene::SurfaceSource source = input.open(session, control.part(0, 0.1));
  const auto paths = output_paths(session.output(), source.frames());
  const auto meshes = mesh.empty() ? std::vector<std::string>() : output_paths(mesh, source.frames());
  session.timing("read");
  Follower follower(*this, session);
  Carried sequence(*this, session);
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const double share = 0.9 / static_cast<double>(paths.size());
    const RunControl part = control.part(0.1 + share * static_cast<double>(i), 0.1 + share * static_cast<double>(i + 1));
    const auto frame = source.frames().empty() ? std::nullopt : std::optional<long>(source.frames()[i]);
    const scene::Surface surface = source.open(frame, part);
    const Box where = box_of(surface);
    Sampled s;
    if (where.empty())
      s.state = "no-surface";
    else if (paths.size() > 1)
      s = method == "packed" ? sequence.frame(*surface.field, where, 1 / source.frames_per_second(), part)
                             : follower.frame(*surface.field, where, 1 / source.frames_per_second(), part);
    else if (method == "packed")
      s = from_spread(*surface.field, where, options(where), part);
    else
      s = from_floaters(*surface.field, where, floater_options(*spacing / kRestSpacing, where), steps.value_or(kSettleSteps),
                        part);
    session.timing("sample");
    session.report()["sampling"] = block(s);
    if (s.cloud.empty()) session.warn("empty", "no surface was found", paths[i]);
    if (s.state == "population-cap" || s.state == "count-missed" || s.state == "step-limit")
      session.warn(s.state, "the sampling is not as asked", paths[i]);
    io::write_cloud(paths[i], s.cloud, session.write_options());
    session.add_output_file(paths[i], s.cloud, frame);
    if (!mesh.empty()) write_particle_mesh(session, meshes[i], s, where, part);
    session.say(fmt::format("{}: {} points, packing {:.3f}, cover {:.3f}, cv {:.3f}, {}", paths[i], grouped(s.cloud.size()),
                            s.evenness.packing, s.evenness.cover, s.evenness.cv, s.state));
    session.timing("write");
  }
  control.progress(1);
}

}  // namespace

void add_sample(CLI::App& app, Session& session) {
  CLI::App* verb = app.add_subcommand("sample",
                                      "Points spread evenly over any surface.\n\n"
                                      "Example: meniscus sample blobs.json --count 5000 -o points.ply");
  auto state = std::make_shared<SampleVerb>();
  state->input.add_to(*verb);
  verb->add_option("--spacing", state->spacing, "distance between neighbours, world units");
  verb->add_option("--count", state->count, "exactly this many points");
  verb->add_option("--curvature", state->curvature,
                   "C >= 0: spacing about 1/(C × curvature) where the surface bends much; default 0, even everywhere");
  verb->add_option("--focus", state->focus, "\"x,y,z\": points crowd there, four times as dense in each direction");
  verb->add_option("--focus-radius", state->focus_radius, "world units; default: a tenth of the surface's diameter");
  verb->add_option("--method", state->method,
                   "packed (default): even as can be; floaters: the particles of Witkin and Heckbert from one seed; "
                   "global: the same with one radius for all")
      ->check(CLI::IsMember({"packed", "floaters", "global"}));
  verb->add_option("--steps", state->steps, "relaxation steps; default 24 (packed) or until rest, at most 400 (floaters)");
  verb->add_flag("--fast", state->fast, "preview: half the time, packing about 0.83 instead of 0.9");
  verb->add_option("--mesh", state->mesh, "also write a triangle mesh of the points themselves");
  verb->add_option("--box", state->box, "\"x,y,z -> x,y,z\": where to sample; default: the surface's own bounds");
  session.add_output(*verb);
  session.add_common(*verb);
  verb->callback([state, &session] { state->run(session); });
}

}  // namespace meniscus::cli
