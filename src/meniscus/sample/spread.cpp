#include <meniscus/base/error.h>
#include <meniscus/sample/closing.h>
#include <meniscus/sample/front.h>
#include <meniscus/sample/mend.h>
#include <meniscus/sample/point_hash.h>
#include <meniscus/sample/projection.h>
#include <meniscus/sample/relax.h>
#include <meniscus/sample/seeds.h>
#include <meniscus/sample/spread.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace meniscus::sample {
namespace {

using enum RelaxOptions::Kernel;

constexpr double kOnSurface = 1e-12;    // of the box diameter; three digits better than promised
constexpr double kSeedCells = 64;       // along the longest side of the box
constexpr double kFrontDensity = 0.97;  // a grown front holds about this share of the hexagonal count
constexpr double kCountRoom = 0.01;
constexpr int kPilots = 4;
constexpr int kHealRounds = 3;
constexpr double kLeap = 4;       // spacings that a point of an earlier arrangement may be from the surface
constexpr double kCrowded = 0.5;  // spacings to another below which it is dropped
constexpr double kVacancy = 1.3;  // empty circles above this, in those of the hexagonal lattice, get a point
// The closing stage: pairs nearer than this are pushed apart.
constexpr RelaxOptions kContact{.kernel = Contact, .reach = 0.92, .steps = 25, .momentum = 0, .step = 0.3};

void check(const Box& box, const SpreadOptions& options) {
  if (box.empty() || !box.finite()) throw InvalidInput("sampling needs a finite box that is not empty");
  if (options.spacing.has_value() == options.count.has_value()) throw InvalidInput("give either a spacing or a count");
  if (options.spacing && (!(*options.spacing > 0) || !std::isfinite(*options.spacing)))
    throw InvalidInput("spacing must be a number above 0, not " + std::to_string(*options.spacing));
  if (options.count && *options.count == 0) throw InvalidInput("count must be at least 1");
  if (options.count && *options.count > options.max_count)
    throw ResourceLimit("count " + std::to_string(*options.count) + " is above the limit of " +
                        std::to_string(options.max_count) + " points");
  if (options.steps < 0) throw InvalidInput("steps must not be negative");
  check(options.density);
  if (!options.start || options.start->empty()) return;
  const auto& has = options.start->attributes;
  if (has.values(meniscus::attribute::kNormal, 3).empty() || has.values(meniscus::attribute::kRadius, 1).empty() ||
      has.integers(meniscus::attribute::kId).empty())
    throw InvalidInput("points to begin with need N, pscale and id");
}

/// The stages of a run over one surface.
class Spreading {
 public:
  Spreading(const field::Field& surface, const Box& box, const SpreadOptions& options, const RunControl& run)
      : surface_(surface), box_(box), options_(options), run_(run), tolerance_(kOnSurface * box.diameter()) {}

  Sampling result() {
    const Seeds seeds = find_seeds(
        surface_, box_, {.resolution = box_.size().maxCoeff() / kSeedCells, .tolerance = tolerance_}, run_.part(0, 0.05));
    report_.not_finite = seeds.not_finite;
    report_.unresolved = seeds.unresolved;
    if (seeds.points.empty()) return {{}, report_};
    run_.progress(0.05, "front");
    if (options_.start && !options_.start->empty())
      resume(seeds.points, *options_.start);
    else
      options_.count ? grow_to_count(seeds.points) : grow(seeds.points, *options_.spacing);
    run_.progress(0.2, "relaxing");
    arrange();
    run_.progress(0.95, "measuring");
    return finished();
  }

 private:
  void grow(const SurfacePoints& seeds, double spacing, const SurfacePoints* occupied = nullptr) {
    Front front = grow_front(surface_, box_, seeds,
                             {.spacing = spacing,
                              .max_count = options_.max_count,
                              .tolerance = tolerance_,
                              .density = options_.density,
                              .occupied = occupied},
                             run_);
    capped_ = front.capped;
    population_ = {std::move(front.points), std::move(front.spacing)};
    population_.id.assign(population_.points.size(), Population::kNewcomer);
    base_spacing_ = spacing;
  }

  /// Points that are there already go to the surface, those that crowd one another or find none are dropped, and the front
  /// grows over what they leave uncovered.
  void resume(const SurfacePoints& seeds, const points::Cloud& start) {
    const auto normals = start.attributes.values(meniscus::attribute::kNormal, 3);
    const auto radii = start.attributes.values(meniscus::attribute::kRadius, 1);
    const auto ids = start.attributes.integers(meniscus::attribute::kId);
    const double spacing = options_.spacing ? *options_.spacing : 2 * *std::max_element(radii.begin(), radii.end());
    SurfacePoints points, kept;
    for (std::size_t i = 0; i < start.size(); ++i)
      points.push_back(start.positions[i], {normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]});
    const SurfacePoints before = points;
    const auto arrived =
        project(surface_, box_, {.tolerance = 1e-3 * spacing, .max_distance = kLeap * spacing}, points, run_);
    const std::vector<double> wanted = wanted_spacing(surface_, options_.density, spacing, points, run_);
    std::vector<std::int64_t> id;
    PointHash hash(box_.center(), spacing);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec3 p = points.position(i);
      if (!arrived[i] || points.normal(i).dot(before.normal(i)) <= 0) continue;
      const double apart = kCrowded * wanted[i];
      if (hash.any_near(p, apart, [&](std::uint32_t k) {
            return (kept.position(k) - p).norm() < apart && kept.normal(k).dot(points.normal(i)) > 0;
          }))
        continue;
      hash.insert(p);
      kept.push_back(p, points.normal(i));
      id.push_back(ids[i]);
    }
    grow(seeds, spacing, &kept);
    std::copy(id.begin(), id.end(), population_.id.begin());
  }

  /// Fronts at better and better spacings until one holds about the wanted count.
  void grow_to_count(const SurfacePoints& seeds) {
    const double wanted = static_cast<double>(*options_.count);
    // About 1.5 seeds per cell side squared of surface: good to 30 %.
    const double cell = box_.size().maxCoeff() / kSeedCells;
    double spacing = hexagonal_spacing(0.7 * static_cast<double>(seeds.size()) * cell * cell, wanted);
    for (int pilot = 0;; ++pilot) {
      grow(seeds, spacing);
      const double grown = static_cast<double>(population_.points.size());
      if (pilot == kPilots || std::abs(grown / kFrontDensity - wanted) <= 0.04 * wanted) break;
      const double ratio = std::clamp(std::sqrt(grown / (kFrontDensity * wanted)), 0.5, 2.0);
      spacing *= ratio;
    }
  }

  void arrange() {
    sort_spatially(population_);
    const bool grown_to_count = options_.count && options_.density.uniform() && !options_.start;
    const std::size_t count =
        options_.count ? *options_.count : std::min(hexagonal_count(population_, box_, run_), options_.max_count);
    if (grown_to_count)  // near enough until the count is reached
      for (double& s : population_.spacing) s /= std::sqrt(kFrontDensity);
    else
      fit_spacing(population_, box_, run_);
    relax_by({.kernel = Smooth, .reach = 2, .steps = options_.fast ? 8 : std::min(10, options_.steps), .momentum = 0.8});
    // A wanted spacing leaves the count a little room.
    const double off = std::abs(static_cast<double>(population_.points.size()) / static_cast<double>(count) - 1);
    if (options_.count || (off > kCountRoom && !options_.fast))
      reach_count(surface_, box_, options_.density, count, options_.count ? 30 : 2, population_, run_);
    if (grown_to_count && off == 0) fit_spacing(population_, box_, run_);
    if (options_.fast) {
      relax_by({.kernel = Smooth, .reach = 2, .steps = 8, .momentum = 0.8});
      relax_by({.kernel = Contact, .reach = 0.92, .steps = 10, .momentum = 0, .step = 0.3});
      return;
    }
    relax_by({.kernel = Smooth, .reach = 2, .steps = options_.steps, .momentum = 0.9});
    if (options_.steps == 0) return;
    relax_by(kContact);
    mend_faults(count);
    if (options_.count && population_.points.size() != count) {
      reach_count(surface_, box_, options_.density, count, 10, population_, run_);
      relax_by({.kernel = Smooth, .reach = 2, .steps = 5, .momentum = 0.8});
    }
  }

  /// Fills the vacancies and relaxes all points.
  void heal(std::size_t count) {
    fill_holes(surface_, box_, kVacancy, options_.max_count, population_, run_);
    relax_by({.kernel = Smooth, .reach = 2, .steps = 5, .momentum = 0.8});
    if (options_.count) reach_count(surface_, box_, options_.density, count, 10, population_, run_);
    relax_by({.kernel = Smooth, .reach = 2, .steps = 10, .momentum = 0.8});
    relax_by(kContact);
  }

  /// Mends place by place; vacancies that are better filled before are, and all points relaxed.
  void mend_faults(std::size_t count) {
    for (int round = 0;; ++round) {
      const bool last = round == kHealRounds || capped_;
      const Mended mended =
          mend(surface_, box_, {.count = options_.count, .max_count = options_.max_count, .leaves_vacancies = !last},
               population_, run_);
      report_.faults = mended.faults;
      if (mended.done) return;
      heal(count);
    }
  }

  void relax_by(const RelaxOptions& stage) {
    if (!options_.density.uniform()) {
      population_.spacing = wanted_spacing(surface_, options_.density, base_spacing_, population_.points, run_);
      fit_spacing(population_, box_, run_);
    }
    relax(surface_, box_, population_.points, population_.spacing, stage, run_, {}, &population_.near);
    report_.steps += stage.steps;
  }

  Sampling finished() {
    std::size_t failed = land(surface_, box_, tolerance_, population_, run_);
    report_.quarantined = failed;
    // What a quarantined point leaves is made good elsewhere, if a count was asked for.
    for (int round = 0; round < kPilots && options_.count && failed > 0; ++round) {
      if (options_.fast || options_.steps == 0)
        reach_count(surface_, box_, options_.density, *options_.count, kPilots, population_, run_);
      else
        mend_faults(*options_.count);
      failed = land(surface_, box_, tolerance_, population_, run_);
    }
    if (report_.quarantined > 0 || !options_.density.uniform()) fit_spacing(population_, box_, run_);
    if (!population_.points.empty())
      report_.spacing = *std::max_element(population_.spacing.begin(), population_.spacing.end());
    number();
    Population& p = population_;
    p.near.refresh(p.points, p.spacing, run_);
    const std::vector<CellMeasure> cells = measure_cells(p.points, p.spacing, p.near.lists(), box_, run_);
    report_.evenness = evenness(surface_, box_, p.points, p.spacing, p.near.lists(), cells, run_);
    report_.state = capped_                                                          ? SpreadState::PopulationCap
                    : options_.count && population_.points.size() != *options_.count ? SpreadState::CountMissed
                                                                                     : SpreadState::Even;
    points::Cloud cloud = make_cloud(surface_, p.points, p.spacing, p.id, cells, run_);
    run_.progress(1);
    return {std::move(cloud), report_};
  }

  /// Newcomers get the next ids, in the order in which they stand; where points were there before, all are stored by id.
  void number() {
    std::int64_t next = options_.next_id;
    for (std::int64_t& id : population_.id)
      if (id == Population::kNewcomer) {
        id = next++;
        ++report_.born;
      }
    if (!options_.start) return;
    report_.died = options_.start->size() - (population_.id.size() - report_.born);
    std::vector<std::uint32_t> order(population_.id.size());
    std::iota(order.begin(), order.end(), 0U);
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return population_.id[a] < population_.id[b]; });
    population_ = population_.gathered(order);
  }

  const field::Field& surface_;
  const Box& box_;
  const SpreadOptions& options_;
  const RunControl& run_;
  double tolerance_;
  double base_spacing_ = 0;
  bool capped_ = false;
  Population population_;
  SpreadReport report_;
};

}  // namespace

std::string_view to_string(SpreadState state) {
  switch (state) {
    case SpreadState::Even: return "even";
    case SpreadState::PopulationCap: return "population-cap";
    case SpreadState::CountMissed: return "count-missed";
    case SpreadState::NoSurface: return "no-surface";
  }
  return "";
}

points::Cloud make_cloud(const field::Field& surface, const Box& box, const SurfacePoints& points,
                         const std::vector<double>& spacing, const std::vector<std::int64_t>& ids, const RunControl& run) {
  const std::vector<CellMeasure> cells = measure_cells(points, spacing, cell_neighbours(points, spacing, run), box, run);
  return make_cloud(surface, points, spacing, ids, cells, run);
}

points::Cloud make_cloud(const field::Field& surface, const SurfacePoints& points, const std::vector<double>& spacing,
                         const std::vector<std::int64_t>& ids, std::span<const CellMeasure> cells, const RunControl& run) {
  points::Cloud cloud;
  const std::vector<Curvature> bend = curvatures(surface, points, run);
  std::vector<double> normal, radius, area, mean, gauss;
  for (std::size_t i = 0; i < points.size(); ++i) {
    cloud.positions.push_back(points.position(i));
    normal.insert(normal.end(), {points.nx[i], points.ny[i], points.nz[i]});
    radius.push_back(0.5 * spacing[i]);
    area.push_back(cells[i].area);
    mean.push_back(bend[i].mean);
    gauss.push_back(bend[i].gauss);
  }
  cloud.attributes.set(meniscus::attribute::kNormal, 3, std::move(normal));
  cloud.attributes.set(meniscus::attribute::kRadius, 1, std::move(radius));
  cloud.attributes.set_integers(meniscus::attribute::kId, 1, ids);
  cloud.attributes.set(attribute::kArea, 1, std::move(area));
  cloud.attributes.set(attribute::kMeanCurvature, 1, std::move(mean));
  cloud.attributes.set(attribute::kGaussCurvature, 1, std::move(gauss));
  return cloud;
}

points::Cloud carried(const field::Field& surface, points::Cloud cloud, double dt, const RunControl& run) {
  field::PositionBatch x(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) x.set(i, cloud.positions[i]);
  field::JetBatch jets(cloud.size(), field::Order::GradientTime);
  field::evaluate(surface, x.view(), jets.view(), run);
  std::vector<double> vx(cloud.size()), vy(cloud.size()), vz(cloud.size());
  surface.material_velocity(x.view(), {vx.data(), vy.data(), vz.data()});
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3 g = jets.gradient(i), v(vx[i], vy[i], vz[i]);
    const double slope2 = g.squaredNorm();
    if (!(slope2 > 0) || !v.allFinite() || !std::isfinite(jets.time(i))) continue;
    const Vec3 velocity = v - (v.dot(g) + jets.time(i)) / slope2 * g;
    if (velocity.allFinite()) cloud.positions[i] += dt * velocity;
  }
  return cloud;
}

Sampling spread(const field::Field& surface, const Box& box, const SpreadOptions& options, const RunControl& run) {
  check(box, options);
  return Spreading(surface, box, options, run).result();
}

}  // namespace meniscus::sample
