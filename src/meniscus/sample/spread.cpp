#include <meniscus/base/error.h>
#include <meniscus/sample/closing.h>
#include <meniscus/sample/front.h>
#include <meniscus/sample/mend.h>
#include <meniscus/sample/projection.h>
#include <meniscus/sample/relax.h>
#include <meniscus/sample/seeds.h>
#include <meniscus/sample/spread.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace meniscus::sample {
namespace {

constexpr double kOnSurface = 1e-12;    // of the box diameter; three digits better than promised
constexpr double kSeedCells = 64;       // along the longest side of the box
constexpr double kFrontDensity = 0.97;  // a grown front holds about this share of the hexagonal count
constexpr double kCountRoom = 0.01;
constexpr int kPilots = 4;
constexpr int kHealRounds = 3;
constexpr double kVacancy = 1.3;  // empty circles above this, in those of the hexagonal lattice, get a point
// The closing stage: pairs nearer than this are pushed apart.
constexpr RelaxOptions kContact{
    .kernel = RelaxOptions::Kernel::Contact, .reach = 0.92, .steps = 25, .momentum = 0, .step = 0.3};

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
    options_.count ? grow_to_count(seeds.points) : grow(seeds.points, *options_.spacing);
    run_.progress(0.2, "relaxing");
    arrange();
    run_.progress(0.95, "measuring");
    return finished();
  }

 private:
  void grow(const SurfacePoints& seeds, double spacing) {
    Front front = grow_front(
        surface_, box_, seeds,
        {.spacing = spacing, .max_count = options_.max_count, .tolerance = tolerance_, .density = options_.density}, run_);
    capped_ = front.capped;
    population_ = {std::move(front.points), std::move(front.spacing)};
    base_spacing_ = spacing;
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
    const std::size_t count =
        options_.count ? *options_.count : std::min(hexagonal_count(population_, box_, run_), options_.max_count);
    fit_spacing(population_, box_, run_);
    using enum RelaxOptions::Kernel;
    relax_by({.kernel = Smooth, .reach = 2, .steps = options_.fast ? 8 : std::min(10, options_.steps), .momentum = 0.8});
    // A wanted spacing leaves the count a little room.
    const double off = std::abs(static_cast<double>(population_.points.size()) / static_cast<double>(count) - 1);
    if (options_.count || (off > kCountRoom && !options_.fast))
      reach_count(surface_, box_, options_.density, count, options_.count ? 30 : 2, population_, run_);
    if (options_.fast) {
      relax_by({.kernel = Smooth, .reach = 2, .steps = 4, .momentum = 0.8});
      return;
    }
    relax_by({.kernel = Smooth, .reach = 2, .steps = options_.steps, .momentum = 0.9});
    if (options_.steps == 0) return;
    for (int round = 0; round < kHealRounds && !capped_; ++round) {
      if (fill_holes(surface_, box_, kVacancy, options_.max_count, population_, run_) == 0) break;
      relax_by({.kernel = Smooth, .reach = 2, .steps = 5, .momentum = 0.8});
      if (options_.count) reach_count(surface_, box_, options_.density, count, 10, population_, run_);
      relax_by({.kernel = Smooth, .reach = 2, .steps = 10, .momentum = 0.8});
    }
    relax_by(kContact);
    mend(surface_, box_, {.count = options_.count, .max_count = options_.max_count}, population_, run_);
    if (options_.count && population_.points.size() != count)
      reach_count(surface_, box_, options_.density, count, 10, population_, run_);
  }

  void relax_by(const RelaxOptions& stage) {
    if (!options_.density.uniform()) {
      population_.spacing = wanted_spacing(surface_, options_.density, base_spacing_, population_.points, run_);
      fit_spacing(population_, box_, run_);
    }
    relax(surface_, box_, population_.points, population_.spacing, stage, run_);
    report_.steps += stage.steps;
  }

  /// Puts all points on the surface and drops those that cannot be; returns how many.
  std::size_t drop_failed() {
    if (population_.points.empty()) return 0;
    const double reach = *std::max_element(population_.spacing.begin(), population_.spacing.end());
    const std::vector<std::uint8_t> arrived =
        project(surface_, box_, {.tolerance = tolerance_, .max_distance = reach}, population_.points, run_);
    std::vector<std::uint32_t> kept;
    for (std::uint32_t i = 0; i < arrived.size(); ++i)
      if (arrived[i]) kept.push_back(i);
    population_ = {population_.points.gathered(kept), gathered(population_.spacing, kept)};
    return arrived.size() - kept.size();
  }

  Sampling finished() {
    std::size_t failed = drop_failed();
    report_.quarantined = failed;
    // What a quarantined point leaves is made good elsewhere, if a count was asked for.
    for (int round = 0; round < kPilots && options_.count && failed > 0; ++round) {
      reach_count(surface_, box_, options_.density, *options_.count, kPilots, population_, run_);
      if (!options_.fast) relax_by(kContact);
      failed = drop_failed();
    }
    if (report_.quarantined > 0 || !options_.density.uniform()) fit_spacing(population_, box_, run_);
    if (!population_.points.empty())
      report_.spacing = *std::max_element(population_.spacing.begin(), population_.spacing.end());
    report_.evenness = evenness(surface_, box_, population_.points, population_.spacing, run_);
    report_.state = capped_                                                          ? SpreadState::PopulationCap
                    : options_.count && population_.points.size() != *options_.count ? SpreadState::CountMissed
                                                                                     : SpreadState::Even;
    std::vector<std::int64_t> ids(population_.points.size());
    std::iota(ids.begin(), ids.end(), 0);
    points::Cloud cloud = make_cloud(surface_, box_, population_.points, population_.spacing, ids, run_);
    run_.progress(1);
    return {std::move(cloud), report_};
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
  points::Cloud cloud;
  const std::vector<CellMeasure> cells = measure_cells(points, spacing, cell_neighbours(points, spacing, run), box, run);
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

Sampling spread(const field::Field& surface, const Box& box, const SpreadOptions& options, const RunControl& run) {
  check(box, options);
  return Spreading(surface, box, options, run).result();
}

}  // namespace meniscus::sample
