#include <meniscus/band/far_distance.h>
#include <meniscus/band/morph.h>
#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>
#include <meniscus/field/primitives.h>

#include <algorithm>
#include <cmath>

namespace meniscus::band {
namespace {

/// The part of the way that is left at fraction s of the time: 1 to 0, eased in and out.
double left_at(double s) { return 1 - s * s * (3 - 2 * s); }

constexpr int kLandingFrames = 4;  // relaxation times after which the last frame lies on B

}  // namespace

/// V = -rate · distance: every point arrives at the same time.
class Morph::Pull final : public Strategy {
 public:
  Pull(const field::Field& to, double voxel, const Box& box, const RunControl& run) : distance(to, voxel, box, run) {}
  std::string name() const override { return "morph"; }
  double max_step() const override { return 0.5 / rate; }
  void add_speed(const SurfaceSamples& at, std::span<double> speed, const RunControl& run) override {
    const field::Positions x = at.crossings.x.view();
    parallel_for(x.size, 256, run, [&](std::size_t i) { speed[i] -= rate * distance.at(x[i]); });
  }

  FarDistance distance;
  double rate = 1;
};

Morph::Morph(const field::Field& from, const field::Field& to, const MorphOptions& options, const Box& box,
             const RunControl& run)
    : options_(options) {
  if (!(options.voxel > 0) || options.frames < 2 || !(options.fps > 0) || !(options.tension >= 0))
    throw InvalidInput("a morph needs a positive voxel and frame rate, two frames or more, and no negative tension");
  Box all = box;
  if (all.empty()) {
    all.extend(from.bounds());
    all.extend(to.bounds());
  }
  if (all.empty()) throw InvalidInput("both shapes of a morph are empty");
  if (!all.finite()) throw InvalidInput("an unbounded shape needs a box");
  all = all.padded(4 * options.voxel);
  pull_ = std::make_shared<Pull>(to, options.voxel, all, run);
  Band start = band_of(from, options.voxel, all, 1u << 20, run);

  // Parts of B that A does not reach begin as seeds.
  const field::PositionBatch nodes = pull_->distance.nodes();
  field::JetBatch jets(nodes.x.size(), field::Order::Value);
  field::evaluate(from, nodes.view(), jets.view(), run);
  std::vector<double> other(nodes.x.size());
  for (std::size_t i = 0; i < other.size(); ++i) other[i] = jets.value(i);
  seeds_.clear();
  for (const auto& deep : pull_->distance.untouched(other))
    seeds_.push_back(band_of(*field::sphere({deep.x.x(), deep.x.y(), deep.x.z()}, 1.6 * options.voxel), options.voxel));

  EvolverOptions evolving;
  evolving.tension = options.tension;
  evolver_ = std::make_unique<Evolver>(std::move(start), evolving);
  evolver_->add(pull_);
}

void Morph::resume(int frame, Band band) {
  if (frame < 0 || frame >= options_.frames) throw InvalidInput("the morph has no such frame");
  frame_ = frame;
  evolver_ = std::make_unique<Evolver>(std::move(band), EvolverOptions{});
  evolver_->add(pull_);
}

MorphReport Morph::next(const RunControl& run) {
  if (frame_ + 1 >= options_.frames) throw InvalidInput("the morph is over");
  MorphReport report;
  ++frame_;
  if (frame_ == 1)
    for (const Band& seed : seeds_) evolver_->edit([&](Band& b) { b.unite(seed); }, run);
  if (frame_ > 0) {
    const double dt = 1 / options_.fps, last = options_.frames - 1.0;
    const bool landing = frame_ + 1 == options_.frames;
    constexpr int kSubsteps = 4;
    for (int i = 0; i < kSubsteps; ++i) {
      // The distance falls from `was` to `is` in proportion; at the end it falls for a few relaxation times.
      const double was = left_at((frame_ - 1 + static_cast<double>(i) / kSubsteps) / last),
                   is = left_at((frame_ - 1 + (i + 1.0) / kSubsteps) / last);
      pull_->rate = landing ? kLandingFrames / dt : std::log(was / is) * kSubsteps / dt;
      evolver_->set_tension(landing ? 0 : options_.tension * was);
      before_ = evolver_->band();
      before_step_ = dt / kSubsteps;
      report.steps += evolver_->advance((frame_ - 1) * dt + i * before_step_, before_step_, before_step_, run).steps;
    }
    if (landing) before_step_ = dt;  // where it lands it rests; what is left of speed is spread over the frame
    evolver_->renew(false, run);
  }
  report.grown = !seeds_.empty();
  for (const Component& c : evolver_->components(run)) {
    report.volume += c.volume;
    report.area += c.area;
    ++report.components;
  }
  report.active_nodes = band().active_nodes();
  const Crossings c = find_crossings(band(), run);
  for (std::size_t i = 0; i < c.size(); ++i)
    report.farthest = std::max(report.farthest, std::abs(pull_->distance.at(c.x.view()[i])) / options_.voxel);
  return report;
}

std::vector<Vec3> Morph::velocities(std::span<const Vec3> at, const RunControl& run) const {
  std::vector<Vec3> out(at.size(), Vec3::Zero());
  if (!before_) return out;
  const double limit = static_cast<double>(band().background());
  parallel_for(at.size(), 256, run, [&](std::size_t i) {
    const double was = std::clamp(before_->sample(at[i]) - band().sample(at[i]), -limit, limit);
    out[i] = was / before_step_ * surface_normal(band(), at[i]);
  });
  return out;
}

}  // namespace meniscus::band
