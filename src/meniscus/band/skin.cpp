#include <meniscus/band/particle_attributes.h>
#include <meniscus/band/particle_shells.h>
#include <meniscus/band/skin.h>
#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace meniscus::band {

/// What particles ask of the skin: to come along with them and to lie on their surface.
class ParticlePull final : public Strategy {
 public:
  std::string name() const override { return "particles"; }
  double max_step() const override { return 0.5 / rate; }
  void add_speed(const SurfaceSamples& at, std::span<double> speed, const RunControl& run) override {
    const field::Positions x = at.crossings.x.view();
    std::vector<double> distance(x.size);
    surface->distance(x, Band::kHalfWidth * at.voxel, distance, run);
    parallel_for(x.size, 256, run, [&](std::size_t i) {
      speed[i] -= rate * distance[i];
      if (carry != nullptr) speed[i] += at.crossings.normal[i].dot(carry->at(x[i]));
    });
  }

  std::shared_ptr<const ParticleSurface> surface;
  std::shared_ptr<const VelocityGrid> carry;
  double rate = 1;
};

namespace {

constexpr int kSettleFrames = 4;            // of relaxation before the first frame
constexpr double kVolumePace = 0.5;         // voxels a frame that a surface moves when particles come or go
constexpr std::size_t kResidualStride = 8;  // of crossings: a mean needs no more

/// What particles stand for, up to a factor.
double liquid(const ParticleState& s) {
  double sum = 0;
  for (const double r : s.radius) sum += r * r * r;
  return sum;
}

/// The liquid of the particles of a frame that the other frame does not have and that lie outside the skin.
double liquid_outside(const ParticleFrame& frame, const ParticleFrame& other, const Band& skin) {
  std::vector<std::int64_t> known = other.id;
  std::sort(known.begin(), known.end());
  double sum = 0;
  for (std::size_t i = 0; i < frame.id.size(); ++i)
    if (!std::binary_search(known.begin(), known.end(), frame.id[i]) && !(skin.sample(frame.state.position[i]) < 0))
      sum += std::pow(frame.state.radius[i], 3);
  return sum;
}

/// A band of spheres.
Band spheres(const std::vector<Vec3>& centre, const std::vector<double>& radius, double voxel, const RunControl& run) {
  ParticleState s;
  s.position = centre;
  s.radius = radius;
  s.velocity.assign(centre.size(), Vec3::Zero());
  s.weight.assign(centre.size(), 1);
  return ParticleSurface(s, {}, run).band(voxel, 1u << 20, run);
}

}  // namespace

double flicker(const Band& a, const Band& b, const Band& c, const RunControl& run) {
  struct Sum {
    double total = 0, count = 0;
  };
  const Sum s = parallel_reduce(
      b.brick_count(), 16, run, Sum{},
      [&](std::size_t begin, std::size_t end) {
        Sum sum;
        for (std::size_t brick = begin; brick < end; ++brick) {
          const std::int32_t p = a.find(b.bricks()[brick]), q = c.find(b.bricks()[brick]);
          if (p < 0 || q < 0) continue;
          for (std::size_t n = 0; n < Band::kBrickNodes; ++n) {
            const float f = b.values()[brick * Band::kBrickNodes + n];
            if (std::abs(f) >= b.voxel()) continue;
            const float e = a.values()[static_cast<std::size_t>(p) * Band::kBrickNodes + n];
            const float g = c.values()[static_cast<std::size_t>(q) * Band::kBrickNodes + n];
            sum.total += static_cast<double>(std::abs(e - 2 * f + g));
            sum.count += 1;
          }
        }
        return sum;
      },
      [](Sum x, Sum y) {
        return Sum{x.total + y.total, x.count + y.count};
      });
  return s.count > 0 ? s.total / s.count / b.voxel() : 0;
}

Skin::Skin(SkinOptions options) : options_(std::move(options)), voxel_(options_.voxel.value_or(0.5 * options_.radius)) {
  const auto positive = [](double v, const char* what) {
    if (!(v > 0) || !std::isfinite(v)) throw InvalidInput(std::string(what) + " must be positive and finite");
  };
  positive(options_.radius, "a skin's particle radius");
  positive(voxel_, "a skin's voxel size");
  positive(options_.follow, "a skin's follow rate");
  if (options_.tension && !(*options_.tension >= 0 && std::isfinite(*options_.tension)))
    throw InvalidInput("tension must be finite and not negative");
  if (!(options_.shells.inner >= 0 && options_.shells.inner <= 1))
    throw InvalidInput("a skin's inner shell must lie between 0 and 1 radii");
  if (!(options_.shells.outer == 0 || options_.shells.outer > 1) || !std::isfinite(options_.shells.outer))
    throw InvalidInput("a skin's outer shell must be 0 (none) or more than one radius");
  if (options_.max_substeps < 1) throw InvalidInput("a skin needs at least one sub-step per frame");
}

std::shared_ptr<ParticleSurface> Skin::target(const ParticleState& particles, const RunControl& run) const {
  return std::make_shared<ParticleSurface>(particles, options_.surface, run);
}

/// Tension smooths what is finer than √(tension / rate of the pull): by default √3 radii, which evens out particles and
/// leaves sheets of two layers and the crests of a splash.
EvolverOptions Skin::evolving(double frame_duration) const {
  EvolverOptions out;
  out.tension = options_.tension.value_or(3 * options_.follow / frame_duration * options_.radius * options_.radius);
  return out;
}

void Skin::set_strategies(double frame_duration) {
  frame_ = frame_duration;
  pull_ = std::make_shared<ParticlePull>();
  pull_->rate = options_.follow / frame_duration;
  evolver_->clear_strategies();
  evolver_->add(pull_);
  if (options_.hold_volume) evolver_->add(std::make_shared<HoldVolume>());
}

SkinReport Skin::start(const points::Cloud& particles, double frame_duration, const RunControl& run) {
  Skin fresh(options_);
  const SkinReport report = fresh.begin(particles, frame_duration, run);
  *this = std::move(fresh);
  return report;
}

SkinReport Skin::begin(const points::Cloud& particles, double frame_duration, const RunControl& run) {
  if (!(frame_duration > 0) || !std::isfinite(frame_duration)) throw InvalidInput("a frame must last longer than nothing");
  ParticleFrame now = particle_frame(particles, options_.radius);
  SkinReport report;
  const auto surface = target(now.state, run);
  evolver_ = std::make_unique<Evolver>(surface->band(voxel_, options_.max_bricks, run), evolving(frame_duration));
  set_strategies(frame_duration);
  pull_->surface = surface;
  if (options_.hold_volume) evolver_->hold_present_volumes(true, run);
  for (int i = 0; i < kSettleFrames; ++i) {
    live(frame_duration, report, run);
    if (options_.hold_volume) evolver_->settle_volumes(run);
  }
  bound(*surface, run);

  const ParticleState& s = now.state;
  const double cell = options_.carry.value_or(8 * options_.radius);
  carry_ = std::make_shared<VelocityGrid>(s.position, s.velocity, s.weight, cell);
  local_ = std::make_shared<VelocityGrid>(s.position, s.velocity, s.weight, 2 * options_.radius);
  report.strays = surface->strays();
  report.substeps = 1;
  finish(*surface, std::move(now), particles, report, run);
  return report;
}

/// All that go_on() changes before it is through.
struct Skin::Before {
  Evolver evolver;
  double frame, owed, before_step;
  std::shared_ptr<const VelocityGrid> carry, local;
  std::optional<Band> before;
};

SkinReport Skin::advance(const points::Cloud& particles, double frame_duration, const RunControl& run) {
  if (!started()) return start(particles, frame_duration, run);
  Before good{*evolver_, frame_, owed_, before_step_, carry_, local_, std::move(before_)};
  try {
    return go_on(particles, frame_duration, good.evolver.band(), run);
  } catch (...) {
    *evolver_ = std::move(good.evolver);
    frame_ = good.frame;
    owed_ = good.owed;
    before_step_ = good.before_step;
    carry_ = std::move(good.carry);
    local_ = std::move(good.local);
    before_ = std::move(good.before);
    throw;
  }
}

SkinReport Skin::go_on(const points::Cloud& particles, double frame_duration, const Band& was, const RunControl& run) {
  SkinReport report;
  ParticleFrame next = particle_frame(particles, options_.radius);
  const ParticleMotion motion(now_, next, frame_duration);
  set_strategies(frame_duration);
  const int substeps =
      std::clamp(static_cast<int>(std::ceil(motion.typical_speed() * frame_duration / voxel_)), 1, options_.max_substeps);
  std::shared_ptr<ParticleSurface> surface;
  for (int i = 0; i < substeps; ++i) {
    const ParticleState state = motion.at((i + 1.0) / substeps);
    surface = target(state, run);
    pull_->surface = surface;
    const double cell = options_.carry.value_or(8 * options_.radius);
    carry_ = std::make_shared<VelocityGrid>(state.position, state.velocity, state.weight, cell);
    pull_->carry = carry_;
    if (i + 1 == substeps)
      local_ = std::make_shared<VelocityGrid>(state.position, state.velocity, state.weight, 2 * options_.radius);
    before_ = evolver_->band();
    before_step_ = frame_duration / substeps;
    report.seeded += seed(*surface, run);
    live(before_step_, report, run);
    bound(*surface, run);
  }
  report.substeps = substeps;
  report.matched = motion.matched();
  report.strays = surface->strays();
  if (options_.hold_volume) adopt_births(next, was, report, run);
  finish(*surface, std::move(next), particles, report, run);
  return report;
}

/// Lets the strategies and the tension act. Tension shrinks a small drop faster than the held volume may push within a step:
/// the volume is settled before much of it is gone.
void Skin::live(double duration, SkinReport& report, const RunControl& run) {
  const double parts = std::clamp(std::ceil(evolver_->tension() * duration / (6 * voxel_ * voxel_)), 1.0, 100.0);
  for (int i = 0; i < static_cast<int>(parts); ++i) {
    const AdvanceReport moved = evolver_->advance(0, duration / parts, std::numeric_limits<double>::infinity(), run);
    report.steps += moved.steps;
    report.max_courant = std::max(report.max_courant, moved.max_courant);
    if (options_.hold_volume && i + 1 < static_cast<int>(parts)) evolver_->settle_volumes(run);
  }
}

/// Particles that the skin does not reach begin a piece of their own: a sphere each, which then grows as it is asked to.
/// What tension alone would eat within a frame is left to keep_droplets().
std::size_t Skin::seed(const ParticleSurface& surface, const RunControl& run) {
  const std::vector<double> depth = depth_of_particles(band(), surface, run);
  const double least = 4 * std::numbers::pi / 3 * std::pow(4 * evolver_->tension() * frame_, 1.5);
  std::vector<Vec3> centre;
  std::vector<double> radius;
  for (const std::uint32_t i : particles_of_new_pieces(surface, depth, least, run)) {
    centre.push_back(surface.positions()[i]);
    radius.push_back(std::max(surface.radii()[i], 1.2 * voxel_));
  }
  if (!centre.empty()) {
    const Band fresh = spheres(centre, radius, voxel_, run);
    evolver_->edit([&](Band& b) { b.unite(fresh); }, run);
  }
  return centre.size();
}

/// What must hold when a sub-step ends. A hard bound comes before the volume.
void Skin::bound(const ParticleSurface& surface, const RunControl& run) {
  const SkinShells& shell = options_.shells;
  if (shell.outer > 0) confine(*evolver_, surface, shell.outer, run);
  if (options_.keep_droplets) keep_droplets(*evolver_, surface, run);
  if (shell.inner > 0) keep_covered(*evolver_, surface, shell.inner, run);
  if (!options_.hold_volume) return;
  evolver_->settle_volumes(run);
  if (shell.inner > 0) keep_covered(*evolver_, surface, shell.inner, run);
}

/// Particles that come or go inside the skin change what components hold in proportion to their liquid, but no faster than
/// the surface may follow: the rest is owed to later frames. Those outside of it were no part of a component. New pieces
/// hold what they have.
void Skin::adopt_births(const ParticleFrame& next, const Band& was, const SkinReport& report, const RunControl& run) {
  const std::vector<Component>& parts = evolver_->components(run);
  const bool by_id = report.matched > 0, by_number = next.id.empty() && report.seeded == 0;
  const double gone = by_id ? liquid_outside(now_, next, was) : 0, come = by_id ? liquid_outside(next, now_, band()) : 0;
  const double before = liquid(now_.state) - gone, after = liquid(next.state) - come;
  if ((by_id || by_number) && before > 0 && after > 0) owed_ *= after / before;
  double depth = 0;  // by which a surface moves when all volumes double
  for (const Component& c : parts)
    if (c.goal && c.area > 0) depth = std::max(depth, std::abs(*c.goal) / c.area);
  const double most = depth > 0 ? kVolumePace * voxel_ / depth : 0;
  const double now = std::clamp(owed_, 1 / (1 + most), 1 + most);
  owed_ /= now;
  std::vector<std::optional<double>> goals;
  for (const Component& c : parts) goals.emplace_back(c.goal ? *c.goal * now : c.volume);
  evolver_->set_goals(goals);
}

/// Tells of the frame and makes it the skin's own; what a later frame reads changes only when nothing can fail any more.
void Skin::finish(const ParticleSurface& surface, ParticleFrame now, points::Cloud cloud, SkinReport& report,
                  const RunControl& run) {
  evolver_->renew(options_.hold_volume && options_.shells.inner == 0, run);
  const Band& b = band();
  const std::vector<double> depth = depth_of_particles(b, surface, run);
  const std::vector<double> freedom = freedom_of_particles(surface, depth, run);
  for (std::size_t i = 0; i < depth.size(); ++i) report.lost += freedom[i] == 1 && depth[i] > surface.radii()[i];
  for (const Component& c : evolver_->components(run)) {
    report.volume += c.volume;
    report.area += c.area;
    report.volume_goal += c.goal.value_or(0);
    // What is smaller than a few voxels no grid can hold.
    if (c.goal && std::abs(*c.goal) > 100 * std::pow(voxel_, 3))
      report.worst_volume_error = std::max(report.worst_volume_error, std::abs(c.volume / *c.goal - 1));
  }
  report.components = evolver_->components(run).size();
  report.active_nodes = b.active_nodes();
  report.particles = now.state.size();
  report.dropped = now.dropped;
  if (last_ && second_last_) report.flicker = flicker(*second_last_, *last_, b, run);
  double off = 0;
  std::size_t counted = 0;
  for (const Vec3& x : thrown_) {
    bool known = false;
    const double d = b.sample(x, &known);
    if (!known) continue;
    off += std::abs(d);
    ++counted;
  }
  if (counted > 0) report.velocity_residual = off / static_cast<double>(counted) / voxel_;
  std::vector<Vec3> thrown = thrown_ahead(run);
  std::optional<Band> last = b;
  thrown_ = std::move(thrown);
  second_last_ = std::move(last_);
  last_ = std::move(last);
  now_ = std::move(now);
  cloud_ = std::move(cloud);
}

/// Where this frame's surface says it will be next.
std::vector<Vec3> Skin::thrown_ahead(const RunControl& run) const {
  if (!before_) return {};
  const Crossings c = find_crossings(band(), run);
  std::vector<Vec3> x;
  for (std::size_t i = 0; i < c.size(); i += kResidualStride) x.push_back(c.x.view()[i]);
  const std::vector<Vec3> v = velocities(x, run);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] += frame_ * v[i];
  return x;
}

std::vector<Vec3> Skin::velocities(std::span<const Vec3> at, const RunControl& run) const {
  std::vector<Vec3> out(at.size(), Vec3::Zero());
  if (carry_ == nullptr) return out;
  parallel_for(at.size(), 256, run, [&](std::size_t i) {
    const Vec3 n = surface_normal(band(), at[i]);
    const Vec3 u = local_->at(at[i]);
    double normal_speed = carry_->at(at[i]).dot(n);
    if (before_) {
      // The potential is a distance: the surface has come as far as the potential was above zero here.
      bool known = false;
      const double was = before_->sample(at[i], &known) - band().sample(at[i]);
      if (known && std::abs(was) < 0.9 * static_cast<double>(before_->background())) normal_speed = was / before_step_;
    }
    out[i] = normal_speed * n + (u - u.dot(n) * n);
  });
  return out;
}

Attributes Skin::carried(std::span<const Vec3> at, const std::vector<std::string>& leave_out, const RunControl& run) const {
  return carried_attributes(cloud_.attributes, now_, 3 * options_.radius, at, leave_out, run);
}

Skin::State Skin::state() {
  State s;
  for (const Component& c : evolver_->components()) s.goals.push_back(c.goal);
  s.owed = owed_;
  return s;
}

void Skin::resume(Band band, const State& state, const points::Cloud& particles, double frame_duration) {
  now_ = particle_frame(particles, options_.radius);
  cloud_ = particles;
  evolver_ = std::make_unique<Evolver>(std::move(band), evolving(frame_duration));
  set_strategies(frame_duration);
  evolver_->set_goals(state.goals);
  owed_ = state.owed;
}

}  // namespace meniscus::band
