#include <meniscus/band/evolver.h>
#include <meniscus/band/kernels.h>
#include <meniscus/band/redistance.h>
#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace meniscus::band {
namespace {

// Transport by extended speeds leaves distances distances, all but the errors of its scheme; tension does not.
constexpr double kTransportShare = 0.1;
constexpr double kKeptReach = 2.5;   // voxels within which samples are distances after every step: what stencils read
constexpr double kBeside = 1.2;      // voxels: nodes next to the surface are nearer, where slopes are within a fifth of one
constexpr double kMaxCurvature = 2;  // per voxel: what the tension of a step counts at most
constexpr double kTensionReach = 3.5;  // voxels within which tension acts
constexpr double kAdaptAfter = 0.9;    // voxels of travel after which bricks wake and drop

StepCoefficients coefficients(const Band& band) {
  StepCoefficients c;
  c.voxel = static_cast<float>(band.voxel());
  c.background = band.background();
  return c;
}

/// Stages s of a Runge-Kutta-Legendre step so that it is stable: dt <= (s² + s)/2 · h²/(6β), and odd (better damping).
int stages_for(double dt, double tension, double voxel) {
  const double ratio = dt * 6 * tension / (voxel * voxel);
  const int s = static_cast<int>(std::ceil(0.5 * (std::sqrt(1 + 8 * ratio) - 1)));
  return std::max(s | 1, 1);
}

Rows all_of(const RowLayers& rows) { return rows[0] | rows[1] | rows[2] | rows[3]; }

double largest(std::span<const double> v) {
  double m = 0;
  for (const double x : v) m = std::max(m, std::abs(x));
  return m;
}

}  // namespace

Evolver::Evolver(Band band, EvolverOptions options) : band_(std::move(band)), options_(options) {
  if (!(options.tension >= 0) || !std::isfinite(options.tension))
    throw InvalidInput("tension must be finite and not negative");
  if (!(options.courant > 0 && options.courant < 1)) throw InvalidInput("the Courant number must lie between 0 and 1");
  band_.adapt();
  outlines_ = outlines_of(band_);
}

bool Evolver::tracks_components() const {
  return std::any_of(strategies_.begin(), strategies_.end(), [](const auto& s) { return s->needs_components(); }) ||
         std::any_of(components_.begin(), components_.end(), [](const Component& c) { return c.goal.has_value(); });
}

void Evolver::track(const RunControl& run) {
  if (tracked_) return;
  Labels now = label_components(band_, run);
  std::vector<Component> fresh = measure_components(band_, now, run);
  const bool had_goals =
      std::any_of(components_.begin(), components_.end(), [](const Component& c) { return c.goal.has_value(); });
  if (had_goals && labels_.begin.size() == now.begin.size()) inherit_goals(labels_, components_, now, fresh);
  labels_ = std::move(now);
  components_ = std::move(fresh);
  tracked_ = true;
}

const std::vector<Component>& Evolver::components(const RunControl& run) {
  track(run);
  return components_;
}

void Evolver::hold_present_volumes(bool all, const RunControl& run) {
  track(run);
  for (Component& c : components_)
    if (all || !c.goal) c.goal = c.volume;
}

void Evolver::set_goals(const std::vector<std::optional<double>>& goals) {
  track({});
  if (goals.size() != components_.size()) throw InvalidInput("one goal per component is needed");
  for (std::size_t i = 0; i < goals.size(); ++i) components_[i].goal = goals[i];
}

std::vector<std::int32_t> Evolver::labels_of(const Crossings& crossings) const {
  std::vector<std::int32_t> out(crossings.size(), 0);
  if (tracked_)
    for (std::size_t i = 0; i < out.size(); ++i)
      out[i] = labels_.of(crossings.inside[i] / Band::kBrickNodes, crossings.inside[i] % Band::kBrickNodes);
  return out;
}

std::vector<double> Evolver::speeds(const Crossings& crossings, double time, double step, const RunControl& run) {
  if (tracks_components()) track(run);
  const std::vector<std::int32_t> component = labels_of(crossings);
  const SurfaceSamples samples{crossings, component, components_, band_.voxel(), time, step};
  std::vector<double> speed(crossings.size(), 0.0);
  for (const auto& strategy : strategies_) {
    strategy->add_speed(samples, speed, run);
    for (const double v : speed)
      if (!std::isfinite(v)) throw Error("strategy '" + strategy->name() + "' asks for a speed that is not finite");
  }
  return speed;
}

/// Gives `work` the halo of every brick with rows within `reach` voxels of the surface, those rows, and room for its new
/// samples, all of which it is to write.
template <class Work>
void Evolver::change_near(double reach, const RunControl& run, const Work& work) {
  const float background = band_.background(), *values = band_.values().data();
  next_.values.resize(band_.values().size());
  parallel_for(band_.brick_count(), 16, run, [&](std::size_t brick) {
    const float* own = values + brick * Band::kBrickNodes;
    float* out = next_.values.data() + brick * Band::kBrickNodes;
    const RowLayers rows = layers_within(outlines_[brick], reach);
    if (rows == RowLayers{}) {
      std::copy_n(own, Band::kBrickNodes, out);
      return;
    }
    Halo phi;
    gather_halo(band_, values, brick, background, -background, phi);
    work(brick, phi, rows, out);
    update_outline(band_, out, outlines_[brick]);
  });
  band_.swap_values(next_.values);
}

/// Moves the surface by `c.c` times its speeds, with tension where `c` has it. Nodes next to the surface and those that they
/// may hand it on to are carried; the distances of all others are to follow.
void Evolver::transport(const Crossings& crossings, std::span<const double> speed, const StepCoefficients& c,
                        const RunControl& run) {
  near_speeds(band_, crossings, speed, speed_, run);
  const double h = band_.voxel(), dt = static_cast<double>(c.c), tension = static_cast<double>(c.tension);
  const double way = largest(speed) * dt / h + kMaxCurvature * tension * dt / (h * h);
  change_near(kBeside + way, run, [&](std::size_t brick, const Halo& phi, const RowLayers& rows, float* out) {
    Halo v;
    extend_speeds(band_, speed_, brick, phi, rows, v);
    kernels().step(phi, v, nullptr, c, all_of(rows), out);
  });
}

/// One step. Tension goes with transport when one stage of it is stable; otherwise it follows. Returns its stages.
int Evolver::move(const Crossings& crossings, std::span<const double> speed, double dt, const RunControl& run) {
  const int stages = options_.tension > 0 ? stages_for(dt, options_.tension, band_.voxel()) : 0;
  const bool moves = largest(speed) > 0;
  if (moves) {
    StepCoefficients c = coefficients(band_);
    c.c = static_cast<float>(dt);
    if (stages == 1) c.tension = static_cast<float>(options_.tension);
    transport(crossings, speed, c, run);
  }
  if (stages > 1 || !moves) {
    if (moves) spread_distances(band_, outlines_, Band::kHalfWidth, next_.values, run);
    relax(stages, dt, run);
  }
  return stages;
}

void Evolver::relax(int stages, double dt, const RunControl& run) {
  StepCoefficients c = coefficients(band_);
  c.tension = static_cast<float>(options_.tension);
  const double share = 2.0 / (stages * stages + stages);
  // Legendre's recurrence: Y_j = (2j-1)/j Y_{j-1} + (1-j)/j Y_{j-2} + (2j-1)/j share dt rate(Y_{j-1}). Where nothing
  // moves it must return the clamped value to the last bit, or the band would grow: hence the form of the kernel.
  for (int j = 1; j <= stages; ++j) {
    c.b = static_cast<float>((1.0 - j) / j);
    c.c = static_cast<float>((2.0 * j - 1) / j * share * dt);
    // Tension fades out over the voxel before the last; stages may move what is near there a little.
    change_near(kTensionReach, run, [&](std::size_t brick, const Halo& phi, const RowLayers& rows, float* out) {
      const float* previous = j > 1 ? before_.values.data() + brick * Band::kBrickNodes : nullptr;
      kernels().step(phi, nullptr, previous, c, all_of(rows), out);
    });  // band: Y_j, next: Y_{j-1}
    before_.values.swap(next_.values);
  }
}

void Evolver::settle_topology(const RunControl& run) {
  tracked_ = false;
  const std::vector<std::int32_t> map = band_.adapt(run);
  if (!map.empty() || band_.empty()) {
    remap_outlines(band_, map, outlines_);
    if (!labels_.begin.empty()) labels_.remap(map);
  }
}

void Evolver::renew(bool volumes, const RunControl& run) {
  redistance(band_, run);
  outlines_ = outlines_of(band_, run);
  tracked_ = false;
  if (volumes) settle_volumes(run);
  travelled_ = 0;
  way_ = 0;
  settle_topology(run);
}

/// Makes samples distances after a step and wakes and drops bricks: near the surface always, else when it is time or
/// `last`.
void Evolver::follow(bool last, AdvanceReport& report, const RunControl& run) {
  tracked_ = false;
  const bool due = travelled_ >= options_.redistance_after;
  if (due) {
    rescale_distances(band_, outlines_, next_.values, run);
    travelled_ = 0;
    ++report.redistancings;
    // One pass more: tension has changed nodes further off, too, and a pass hands on from brick to brick what was there.
    spread_distances(band_, outlines_, Band::kHalfWidth, next_.values, run);
  }
  const bool all = due || last || way_ >= kAdaptAfter;
  spread_distances(band_, outlines_, all ? Band::kHalfWidth : kKeptReach + way_, next_.values, run);
  if (all) {
    settle_topology(run);
    way_ = 0;
  }
}

AdvanceReport Evolver::advance(double time, double duration, double max_step, const RunControl& run) {
  if (!(duration >= 0) || !std::isfinite(duration)) throw InvalidInput("a duration must be finite and not negative");
  const Evolver good = *this;
  AdvanceReport report;
  const double h = band_.voxel();
  // Level sets at the rim of the band do not feel tension: it must not act longer than they can wait for a redistancing.
  double limit = options_.tension > 0 ? std::min(max_step, 2 * h * h / options_.tension) : max_step;
  for (const auto& s : strategies_) limit = std::min(limit, s->max_step());
  try {
    double left = duration;
    double planned = std::min(limit, left);
    Crossings crossings;
    const bool normals =
        std::any_of(strategies_.begin(), strategies_.end(), [](const auto& s) { return s->needs_normals(); });
    while (left > 0 && !band_.empty()) {
      run.check();
      if (report.steps == options_.max_steps)
        throw Error("the surface moves too fast: more than " + std::to_string(options_.max_steps) + " steps for one frame");
      planned = std::min({planned, limit, left});
      find_crossings(band_, outlines_, normals, crossings, run);
      if (crossings.size() == 0) {  // the last piece has vanished
        band_.keep_surface(run);
        outlines_ = outlines_of(band_, run);
        settle_topology(run);
        break;
      }
      const std::vector<double> speed = speeds(crossings, time + (duration - left), planned, run);
      const double fastest = largest(speed);
      double dt = planned;
      if (fastest * dt > options_.courant * h) dt = options_.courant * h / fastest;
      if (left - dt < 1e-9 * duration) dt = left;
      report.tension_stages += move(crossings, speed, dt, run);
      travelled_ += kTransportShare * fastest * dt / h + 0.5 * options_.tension * dt / (h * h);
      report.max_speed = std::max(report.max_speed, fastest);
      report.max_courant = std::max(report.max_courant, fastest * dt / h);
      ++report.steps;
      way_ += fastest * dt / h + 0.5 * options_.tension * dt / (h * h);
      left = dt == left ? 0 : left - dt;
      follow(left == 0, report, run);
      planned = 2 * dt;
    }
  } catch (...) {
    *this = good;
    throw;
  }
  return report;
}

void Evolver::settle_volumes(const RunControl& run) {
  AdvanceReport report;
  for (int round = 0; round < 6; ++round) {
    track(run);
    bool done = true;
    const Crossings crossings = find_crossings(band_, run);
    std::vector<double> shift(crossings.size(), 0.0);
    const std::vector<std::int32_t> component = labels_of(crossings);
    for (std::size_t i = 0; i < shift.size(); ++i) {
      if (component[i] < 0) continue;
      const Component& c = components_[static_cast<std::size_t>(component[i])];
      if (!c.goal || !(c.area > 0) || std::abs(*c.goal - c.volume) <= 1e-5 * std::abs(*c.goal)) continue;
      shift[i] = std::clamp((*c.goal - c.volume) / c.area, -0.5 * band_.voxel(), 0.5 * band_.voxel());
      done = false;
    }
    if (done) return;
    travelled_ += largest(shift) / band_.voxel();
    way_ += largest(shift) / band_.voxel();
    StepCoefficients c = coefficients(band_);
    c.c = 1;
    transport(crossings, shift, c, run);
    follow(false, report, run);
  }
}

void Evolver::edit(FunctionRef<void(Band&)> edit, const RunControl& run) {
  if (tracks_components()) track(run);
  const std::vector<Coord> before = band_.bricks();
  edit(band_);
  if (band_.bricks() != before && !labels_.begin.empty()) {
    // Labels follow their bricks, so that goals can be handed on.
    std::vector<std::int32_t> map(band_.brick_count());
    for (std::size_t b = 0; b < map.size(); ++b) {
      const auto it = std::lower_bound(before.begin(), before.end(), band_.bricks()[b]);
      map[b] = it != before.end() && *it == band_.bricks()[b] ? static_cast<std::int32_t>(it - before.begin()) : -1;
    }
    labels_.remap(map);
  }
  outlines_ = outlines_of(band_, run);
  settle_topology(run);
}

}  // namespace meniscus::band
