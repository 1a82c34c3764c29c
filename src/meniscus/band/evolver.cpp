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
constexpr double kTransportShare = 0.375;
constexpr int kRenewalPasses = 3;  // between steps samples are nearly distances already

/// Calls work(brick, its halo) for all bricks; `gather` is gather_halo or gather_star.
template <class Gather, class Work>
void for_halos(const Band& band, const Gather& gather, const RunControl& run, const Work& work) {
  const float b = band.background();
  parallel_for(band.brick_count(), 16, run, [&](std::size_t brick) {
    Halo halo;
    gather(band, band.values().data(), brick, b, -b, halo);
    work(brick, halo);
  });
}

/// One stage of tension.
void stage(const Band& band, const float* previous, const StepCoefficients& c, std::vector<float>& out,
           const RunControl& run) {
  out.resize(band.values().size());
  for_halos(band, gather_halo, run, [&](std::size_t brick, const Halo& halo) {
    const std::size_t n = brick * Band::kBrickNodes;
    kernels().step(halo, nullptr, previous ? previous + n : nullptr, c, out.data() + n);
  });
}

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

/// Moves the surface by `c.c` times its speeds, with tension where `c` has it.
void Evolver::transport(const Crossings& crossings, std::span<const double> speed, const StepCoefficients& c,
                        const RunControl& run) {
  near_speeds(band_, crossings, speed, speed_.values, run);
  // Two passes carry speeds to the rim; the second one goes straight on to the step.
  before_.values.resize(band_.values().size());
  next_.values.resize(band_.values().size());
  for_halos(band_, gather_star, run, [&](std::size_t brick, const Halo& phi) {
    Halo v;
    extend_speeds(band_, speed_.values, brick, phi, v);
    kernels().centre(v, before_.values.data() + brick * Band::kBrickNodes);
  });
  for_halos(band_, gather_halo, run, [&](std::size_t brick, const Halo& phi) {
    Halo v;
    extend_speeds(band_, before_.values, brick, phi, v);
    kernels().step(phi, v, nullptr, c, next_.values.data() + brick * Band::kBrickNodes);
  });
  band_.swap_values(next_.values);
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
  if (stages > 1 || !moves) relax(stages, dt, run);
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
    stage(band_, j > 1 ? before_.values.data() : nullptr, c, next_.values, run);
    band_.swap_values(next_.values);  // band: Y_j, next: Y_{j-1}
    before_.values.swap(next_.values);
  }
}

void Evolver::settle_topology(const RunControl& run) {
  tracked_ = false;
  const std::vector<std::int32_t> map = band_.adapt(run);
  if (!labels_.begin.empty() && (!map.empty() || band_.empty())) labels_.remap(map);
}

void Evolver::renew(const RunControl& run) {
  redistance(band_, run);
  travelled_ = 0;
  settle_topology(run);
}

void Evolver::renew_if_due(const RunControl& run, AdvanceReport& report) {
  if (travelled_ < options_.redistance_after) return;
  redistance(band_, kRenewalPasses, next_.values, run);
  travelled_ = 0;
  ++report.redistancings;
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
    while (left > 0 && !band_.empty()) {
      run.check();
      if (report.steps == options_.max_steps)
        throw Error("the surface moves too fast: more than " + std::to_string(options_.max_steps) + " steps for one frame");
      planned = std::min({planned, limit, left});
      find_crossings(band_, crossings, run);
      if (crossings.size() == 0) {  // the last piece has vanished
        band_.keep_surface(run);
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
      settle_topology(run);
      renew_if_due(run, report);
      left = dt == left ? 0 : left - dt;
      planned = 2 * dt;
    }
  } catch (...) {
    *this = good;
    throw;
  }
  return report;
}

void Evolver::settle_volumes(const RunControl& run) {
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
    StepCoefficients c = coefficients(band_);
    c.c = 1;
    transport(crossings, shift, c, run);
    settle_topology(run);
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
  settle_topology(run);
}

}  // namespace meniscus::band
