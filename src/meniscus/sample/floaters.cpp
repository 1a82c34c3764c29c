#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>
#include <meniscus/base/random.h>
#include <meniscus/sample/floaters.h>
#include <meniscus/sample/projection.h>
#include <meniscus/sample/repulsion.h>
#include <meniscus/sample/seeds.h>
#include <meniscus/sample/spread.h>
#include <meniscus/sample/surface_cell.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>

namespace meniscus::sample {
namespace {

constexpr double kOnSurface = 1e-12;  // of the box diameter
constexpr double kStray = 0.5;        // radii off the surface at which feedback gives way to Newton steps
constexpr double kMaxDrift = 0.4;     // radii per step, near equilibrium
constexpr double kGrown = 2;          // wanted radii below which particles have momentum: those above have to split first
constexpr double kMaxMove = 1.0;      // radii per step, along the surface
constexpr double kPushApart = 0.5;    // radii between a parent and each child
constexpr std::size_t kSimpleBlock = 4096;  // particles at once in loops that do little for each
constexpr std::size_t kManyBirths = 32;     // more than one to this many: lists are found anew, not mended
constexpr double kSingular = 1e-9;          // |∇F| over its mean
constexpr double kTilePerRadius2 = 3.523;   // area a particle at rest holds, in σ²

double mean_slope(const field::JetBatch& jets, std::size_t n, const RunControl& run) {
  const auto slopes = [&](std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t i = begin; i < end; ++i) sum += jets.gradient(i).norm();
    return sum;
  };
  return parallel_reduce(n, kSimpleBlock, run, 0.0, slopes, std::plus<>()) / static_cast<double>(n);
}

void check(const Box& box, const FloaterOptions& o) {
  if (box.empty() || !box.finite()) throw InvalidInput("floaters need a finite box that is not empty");
  if (!(o.radius > 0) || !std::isfinite(o.radius)) throw InvalidInput("the wanted radius must be a number above 0");
  if (!(o.time_step > 0 && o.feedback > 0 && o.feedback * o.time_step < 2))
    throw InvalidInput("feedback · time_step must lie between 0 and 2");
  if (!(o.energy_feedback > 0 && o.energy_feedback * o.time_step < 2))
    throw InvalidInput("energy_feedback · time_step must lie between 0 and 2");
  if (!(o.alpha > 0 && o.wanted_energy > 0 && o.beta > 0 && o.rest_speed > 0 && o.split_energy >= 0))
    throw InvalidInput("constants of the repulsion must be positive");
  if (!(o.death_radius >= 0 && o.death_radius < 1)) throw InvalidInput("death_radius must lie in [0, 1)");
  if (!(o.momentum >= 0 && o.momentum < 1)) throw InvalidInput("momentum must lie in [0, 1)");
  if (!(o.radius_step > 0 && o.radius_step < 1)) throw InvalidInput("radius_step must lie in (0, 1)");
  if (!(o.search_cells >= 1)) throw InvalidInput("search_cells must be at least 1");
  if (o.max_count == 0) throw InvalidInput("max_count must be at least 1");
  if (o.largest_radius && !(*o.largest_radius > 0)) throw InvalidInput("the largest radius must be above 0");
  check(o.density);
}

Vec3 shortened(const Vec3& v, double longest) {
  const double length = v.norm();
  return length > longest ? Vec3(longest / length * v) : v;
}

}  // namespace

Floaters::Floaters(const Box& box, const FloaterOptions& options, RunControl run)
    : box_(box), options_(options), run_(std::move(run)) {
  check(box, options);
}

void Floaters::set_box(const Box& box) {
  check(box, options_);
  box_ = box;
}

double Floaters::largest_radius() const {
  return options_.largest_radius.value_or(std::max(0.5 * surface_size_, 1.5 * options_.radius));
}

void Floaters::append(const Vec3& position, const Vec3& normal, double radius) {
  points_.push_back(position, normal);
  sigma_.push_back(radius);
  energy_.push_back(0);
  speed_.push_back(std::numeric_limits<double>::infinity());
  drift_.insert(drift_.end(), 3, 0.0F);
  if (!options_.density.uniform()) wanted_.push_back(options_.radius);
  id_.push_back(next_id_++);
  ++unsorted_;
}

void Floaters::add(const Vec3& position, const Vec3& normal, std::optional<double> radius) {
  append(position, normal, radius.value_or(largest_radius()));
  neighbours_.clear();
}

FloaterStep Floaters::step(const field::Field& surface, double dt) {
  FloaterStep report;
  if (step_ == 0 || (options_.search_interval > 0 && step_ % static_cast<std::uint64_t>(options_.search_interval) == 0))
    search(surface, report);
  if (!options_.density.uniform()) wanted_ = wanted_spacing(surface, options_.density, options_.radius, points_, run_);
  // Births come before the move: children are put on the surface where it is now, and then carried along with their parents.
  if (options_.method == FloaterOptions::Method::Global)
    divide_global(surface, report);
  else
    populate(surface, report);
  move(surface, dt, report);
  ++step_;
  capped_ = capped_ || report.capped;
  const bool quiet = report.born.empty() && report.died.empty() && report.lost.empty() && report.moving == 0;
  quiet_steps_ = quiet ? quiet_steps_ + 1 : 0;
  return report;
}

int Floaters::settle(const field::Field& surface, int max_steps) {
  int steps = 0;
  for (; steps < max_steps && !settled(); ++steps) {
    step(surface);
    run_.progress(static_cast<double>(steps) / max_steps, "floaters");
  }
  return steps;
}

/// Puts a particle on every part of the surface that none covers: at first one per component, later what was born or reached
/// into the box since.
void Floaters::search(const field::Field& surface, FloaterStep& report) {
  const double cell = box_.size().maxCoeff() / options_.search_cells;
  const Seeds seeds = find_seeds(surface, box_, {.resolution = cell, .tolerance = kOnSurface * box_.diameter()}, run_);
  if (seeds.points.empty()) return;
  Box extent;
  for (std::size_t i = 0; i < seeds.points.size(); ++i) extent.extend(seeds.points.position(i));
  surface_size_ = std::max(surface_size_, extent.diameter());

  // Seeds within reach of a particle, or of a seed that hangs together with one, are covered.
  const std::size_t n = points_.size(), all = n + seeds.points.size();
  SurfacePoints both = points_;
  std::vector<double> reach(all, 1.8 * cell);
  for (std::size_t i = 0; i < n; ++i) reach[i] = 2.5 * sigma_[i];
  for (std::size_t i = 0; i < seeds.points.size(); ++i) both.push_back(seeds.points.position(i), seeds.points.normal(i));
  const Neighbours near = find_neighbours(both.positions(), reach, run_);
  std::vector<std::uint8_t> covered(all, 0);
  std::vector<std::uint32_t> stack;
  for (std::size_t s = n; s < all; ++s)
    for (const std::uint32_t j : near.of(s))
      if (j < n && same_sheet(both, s, j) > 0) covered[s] = 1;
  const bool first = n == 0;
  for (std::uint32_t s = static_cast<std::uint32_t>(n); s < all; ++s) {
    if (covered[s]) continue;
    if (points_.size() >= options_.max_count) {
      report.capped = true;
      return;
    }
    // A seed speaks for all that hang together with it; in a run under way only for the uncovered ones.
    add(both.position(s), both.normal(s),
        first ? std::optional<double>() : std::min(largest_radius(), std::max(options_.radius, 0.5 * cell)));
    report.born.push_back(id_.back());
    ++report.seeded;
    covered[s] = 1;
    for (stack.assign(1, s); !stack.empty();) {
      const std::uint32_t a = stack.back();
      stack.pop_back();
      for (const std::uint32_t j : near.of(a))
        if (j >= n && !covered[j] && (both.position(a) - both.position(j)).norm() < 1.8 * cell) {
          covered[j] = 1;
          stack.push_back(j);
        }
    }
  }
}

/// Particles far off the surface (it jumped, or they were added off it) go back by Newton steps; those for which there is no
/// surface to go to are removed.
bool Floaters::recover(const field::Field& surface, const field::JetBatch& jets, FloaterStep& report) {
  using Indices = std::vector<std::uint32_t>;
  const auto strays = [&](std::size_t begin, std::size_t end) {
    Indices found;
    for (std::size_t i = begin; i < end; ++i) {
      const double distance = std::abs(jets.value(i)) / jets.gradient(i).norm();
      if (!(distance <= kStray * std::max(sigma_[i], wanted_radius(i)))) found.push_back(static_cast<std::uint32_t>(i));
    }
    return found;
  };
  const Indices stray =
      parallel_reduce(points_.size(), kSimpleBlock, run_, Indices{}, strays, [](Indices a, const Indices& b) {
        a.insert(a.end(), b.begin(), b.end());
        return a;
      });
  if (stray.empty()) return false;
  SurfacePoints moved = points_.gathered(stray);
  const std::vector<std::uint8_t> arrived =
      project(surface, box_, {.tolerance = 1e-3 * options_.radius, .max_distance = 0.25 * box_.diameter()}, moved, run_);
  std::vector<std::uint32_t> lost;
  for (std::size_t k = 0; k < stray.size(); ++k) {
    const std::uint32_t i = stray[k];
    if (arrived[k]) {
      put(i, moved.position(k), moved.normal(k));
    } else if (jets.gradient(i).norm() != 0 || jets.value(i) != 0) {
      // ∇F = 0 on the surface itself is a singular point, not a lost one.
      lost.push_back(i);
      report.lost.push_back(id_[i]);
    }
  }
  remove(lost);
  return true;
}

void Floaters::update_neighbours() {
  if (neighbours_.mend(points_, sigma_, run_)) return;
  if (10 * unsorted_ > points_.size()) sort();
  neighbours_.find(points_, sigma_, run_);
}

/// The way that repulsion asks for, with momentum where a grown particle is nearly at rest; remembers it.
Vec3 Floaters::drift(std::size_t i, const Vec3& normal, const Vec3& along) {
  float* last = drift_.data() + 3 * i;
  Vec3 step = options_.time_step * along;
  if (along.norm() < options_.rest_speed * sigma_[i] && sigma_[i] < kGrown * wanted_radius(i)) {
    const Vec3 before = sigma_[i] * Vec3(last[0], last[1], last[2]);
    step = shortened(step + options_.momentum * (before - before.dot(normal) * normal), kMaxDrift * sigma_[i]);
  }
  for (int a = 0; a < 3; ++a) last[a] = static_cast<float>(step[a] / sigma_[i]);
  return step;
}

/// A radius after one step towards the wanted energy [WH94], capped in its change.
double Floaters::next_radius(std::size_t i, const Repulsion& r) const {
  const double beta = options_.beta / wanted_radius(i), wanted = options_.wanted_energy * options_.alpha;
  const double rate = -options_.energy_feedback * (r.energy - wanted) / (r.energy_slope + beta);
  const double most = options_.radius_step * sigma_[i];
  return std::min(sigma_[i] + std::clamp(rate * options_.time_step, -most, most), 1.5 * largest_radius());
}

/// Constraint (2.1) with the repulsion as desired velocity, radii by their energies; one Euler step.
void Floaters::move(const field::Field& surface, double dt, FloaterStep& report) {
  if (points_.empty()) return;
  const auto evaluated = [&] {
    field::JetBatch j(points_.size(), dt == 0 ? field::Order::Gradient : field::Order::GradientTime);
    field::evaluate(surface, points_.positions(), j.view(), run_);
    return j;
  };
  update_neighbours();  // may put the particles in another order
  field::JetBatch jets = evaluated();
  if (recover(surface, jets, report)) {
    if (points_.empty()) return;
    update_neighbours();
    jets = evaluated();
  }
  const std::size_t n = points_.size();
  const double singular = kSingular * mean_slope(jets, n, run_);

  SurfacePoints next = points_;
  std::vector<double> next_sigma = sigma_;
  const double h = options_.time_step;
  struct Sum {
    std::size_t singular = 0, moving = 0;
    double speed = 0;
  };
  const auto block = [&](std::size_t begin, std::size_t end) {
    Sum sum;
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 p = points_.position(i), g = jets.gradient(i);
      const double slope = g.norm(), f = jets.value(i);
      if (!(slope > singular) || !std::isfinite(f)) {
        ++sum.singular;
        speed_[i] = 0;
        continue;
      }
      const Vec3 n_i = g / slope;
      const Repulsion r = repulsion(points_, sigma_, options_.alpha, i, neighbours_.of(i));
      const Vec3 along = shortened(r.velocity - r.velocity.dot(n_i) * n_i, kMaxMove * sigma_[i] / h);
      const Vec3 step = drift(i, n_i, along);
      // (2.1) split by what drives it: repulsion and feedback run in the particles' time, the surface in its own.
      const Vec3 home = h * options_.feedback * newton_step(box_, p, f, g);
      const Vec3 carried = dt == 0 ? Vec3(Vec3::Zero()) : Vec3(-dt * jets.time(i) / slope * n_i);
      const Vec3 q = (p + step + home + carried).cwiseMax(box_.min).cwiseMin(box_.max);
      if (q.allFinite()) {
        next.set_position(i, q);
        neighbours_.moved(i, q - p);
      }
      next.set_normal(i, n_i);
      speed_[i] = along.norm() / sigma_[i];
      energy_[i] = r.energy;
      next_sigma[i] = next_radius(i, r);
      sum.moving += speed_[i] > options_.rest_speed;
      sum.speed += speed_[i];
    }
    return sum;
  };
  const Sum sum = parallel_reduce(n, field::kBlock, run_, Sum{}, block, [](Sum a, const Sum& b) {
    return Sum{a.singular + b.singular, a.moving + b.moving, a.speed + b.speed};
  });
  points_ = std::move(next);
  if (options_.method == FloaterOptions::Method::Adaptive) sigma_ = std::move(next_sigma);
  report.singular = sum.singular;
  report.moving = moving_ = sum.moving;
  report.mean_speed = sum.speed / static_cast<double>(n);
}

/// Fission and death of the particles near equilibrium.
void Floaters::populate(const field::Field& surface, FloaterStep& report) {
  const double wanted_energy = options_.wanted_energy * options_.alpha;
  std::vector<std::uint32_t> parents, dying;
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    if (speed_[i] >= options_.rest_speed) continue;  // a newcomer has not moved yet: infinite
    const double radius = wanted_radius(i), smallest = options_.death_radius * radius;
    if (sigma_[i] > largest_radius() || (energy_[i] > options_.split_energy * wanted_energy && sigma_[i] > radius)) {
      parents.push_back(i);
    } else if (sigma_[i] < smallest &&
               random_uniform(run_.seed(), static_cast<std::uint64_t>(id_[i]), step_)[0] > sigma_[i] / smallest) {
      dying.push_back(i);
      report.died.push_back(id_[i]);
    }
  }
  split(surface, parents, report);
  remove(dying);
}

/// The simple scheme: one radius; when all rest, every particle splits and the radius shrinks.
void Floaters::divide_global(const field::Field& surface, FloaterStep& report) {
  if (global_radius_ == 0) global_radius_ = largest_radius();
  if (step_ > 0 && moving_ == 0 && global_radius_ > options_.radius) {
    std::vector<std::uint32_t> parents(points_.size());
    std::iota(parents.begin(), parents.end(), 0u);
    global_radius_ = std::max(options_.radius, global_radius_ / std::numbers::sqrt2);
    split(surface, parents, report);
  }
  std::fill(sigma_.begin(), sigma_.end(), global_radius_);
}

/// Each parent becomes two, pushed apart in a random tangent direction; the parent keeps its id. A child that does not land
/// on the parent's sheet is not born. The cap holds before every birth.
void Floaters::split(const field::Field& surface, const std::vector<std::uint32_t>& parents, FloaterStep& report) {
  if (parents.empty()) return;
  const std::size_t room = options_.max_count - std::min(options_.max_count, points_.size());
  const std::size_t births = std::min(parents.size(), room);
  report.capped = report.capped || births < parents.size();
  SurfacePoints children;
  for (std::size_t k = 0; k < births; ++k) {
    const std::uint32_t i = parents[k];
    Vec3 u, v;
    tangent_frame(points_.normal(i), u, v);
    const double angle = 2 * std::numbers::pi * random_uniform(run_.seed(), static_cast<std::uint64_t>(id_[i]), step_)[1];
    const Vec3 aside = kPushApart * std::min(sigma_[i], largest_radius()) * (std::cos(angle) * u + std::sin(angle) * v);
    children.push_back(points_.position(i) + aside, points_.normal(i));
    children.push_back(points_.position(i) - aside, points_.normal(i));
  }
  if (children.empty()) return;
  if (kManyBirths * births > points_.size()) neighbours_.clear();
  const std::vector<std::uint8_t> arrived =
      project(surface, box_, {.tolerance = 1e-3 * options_.radius, .max_distance = 0.5 * box_.diameter()}, children, run_);
  for (std::size_t k = 0; k < births; ++k) {
    const std::uint32_t i = parents[k];
    const auto landed = [&](std::size_t c) {
      return arrived[c] && children.normal(c).dot(points_.normal(i)) > 0 &&
             (children.position(c) - points_.position(i)).norm() < 2 * sigma_[i];
    };
    if (options_.method == FloaterOptions::Method::Adaptive) sigma_[i] /= std::numbers::sqrt2;
    if (!landed(2 * k) || !landed(2 * k + 1)) continue;
    append(points_.position(i), points_.normal(i), sigma_[i]);
    neighbours_.born(i);
    if (!wanted_.empty()) wanted_.back() = wanted_[i];
    put(i, children.position(2 * k), children.normal(2 * k));
    put(points_.size() - 1, children.position(2 * k + 1), children.normal(2 * k + 1));
    report.born.push_back(id_.back());
  }
}

void Floaters::put(std::size_t i, const Vec3& position, const Vec3& normal) {
  neighbours_.moved(i, position - points_.position(i));
  points_.set_position(i, position);
  points_.set_normal(i, normal);
}

/// Removes particles; the last ones take their places.
void Floaters::remove(std::span<const std::uint32_t> rising) {
  for (std::size_t k = rising.size(); k-- > 0;) {
    const std::size_t i = rising[k], last = points_.size() - 1;
    points_.set_position(i, points_.position(last));
    points_.set_normal(i, points_.normal(last));
    points_.resize(last);
    for (auto* values : {&sigma_, &energy_, &speed_, &wanted_}) {
      if (values->empty()) continue;  // wanted_ of an even density
      (*values)[i] = values->back();
      values->pop_back();
    }
    std::copy_n(drift_.end() - 3, 3, drift_.begin() + static_cast<std::ptrdiff_t>(3 * i));
    drift_.resize(3 * last);
    id_[i] = id_.back();
    id_.pop_back();
    neighbours_.died(i);
  }
  unsorted_ += rising.size();
}

/// Puts the particles in spatial order, so that neighbours lie close by in memory.
void Floaters::sort() {
  const double cell = 2 * *std::min_element(sigma_.begin(), sigma_.end());
  const std::vector<std::uint32_t> order = spatial_order(points_.positions(), cell);
  points_ = points_.gathered(order);
  sigma_ = gathered(sigma_, order);
  energy_ = gathered(energy_, order);
  speed_ = gathered(speed_, order);
  std::vector<float> drift(3 * order.size());
  for (std::size_t k = 0; k < order.size(); ++k)
    std::copy_n(drift_.data() + 3 * std::size_t{order[k]}, 3, drift.data() + 3 * k);
  drift_ = std::move(drift);
  if (!wanted_.empty()) wanted_ = gathered(wanted_, order);
  id_ = gathered(id_, order);
  unsorted_ = 0;
}

std::size_t Floaters::bytes() const {
  const std::size_t numbers = 6 * points_.x.capacity() + sigma_.capacity() + energy_.capacity() + speed_.capacity() +
                              wanted_.capacity() + id_.capacity();
  return 8 * numbers + 4 * drift_.capacity() + neighbours_.bytes();
}

std::vector<double> Floaters::spacing() const {
  std::vector<double> s = sigma_;
  for (double& v : s) v *= std::sqrt(kTilePerRadius2 / (0.5 * std::sqrt(3.0)));
  return s;
}

points::Cloud Floaters::cloud(const field::Field& surface, std::size_t* dropped) const {
  SurfacePoints on = points_;
  std::vector<std::uint8_t> arrived(on.size());
  arrived =
      project(surface, box_, {.tolerance = kOnSurface * box_.diameter(), .max_distance = 0.25 * box_.diameter()}, on, run_);
  std::vector<std::uint32_t> order(on.size());
  std::iota(order.begin(), order.end(), 0u);
  std::erase_if(order, [&](std::uint32_t i) { return !arrived[i]; });
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return id_[a] < id_[b]; });
  if (dropped) *dropped = on.size() - order.size();
  return make_cloud(surface, box_, on.gathered(order), gathered(spacing(), order), gathered(id_, order), run_);
}

Evenness Floaters::measured(const field::Field& surface) const {
  SurfacePoints on = points_;
  project(surface, box_, {.tolerance = kOnSurface * box_.diameter(), .max_distance = 0.25 * box_.diameter()}, on, run_);
  // An even density is judged by one spacing for all: radii that differ are unevenness, not intent.
  std::vector<double> s = spacing();
  if (options_.density.uniform() && !s.empty()) {
    double sum2 = 0;
    for (const double v : s) sum2 += v * v;
    std::fill(s.begin(), s.end(), std::sqrt(sum2 / static_cast<double>(s.size())));
  }
  return evenness(surface, box_, on, s, run_);
}

}  // namespace meniscus::sample
