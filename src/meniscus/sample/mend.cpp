#include <meniscus/base/random.h>
#include <meniscus/sample/evenness.h>
#include <meniscus/sample/holes.h>
#include <meniscus/sample/mend.h>
#include <meniscus/sample/point_hash.h>
#include <meniscus/sample/projection.h>
#include <meniscus/sample/relax.h>
#include <meniscus/sample/surface_cell.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <tuple>

namespace meniscus::sample {
namespace {

constexpr double kPatch = 3.5;    // spacings about a fault that may move at first,
constexpr double kWidePatch = 6;  // and after kNarrowRounds
constexpr int kNarrowRounds = 4;
constexpr double kJudged = 1.5;          // spacings beyond a patch whose particles are judged,
constexpr double kFelt = 2.7;            // and felt
constexpr double kShake = 0.35;          // spacings
constexpr double kManyVacancies = 0.01;  // of all particles
constexpr double kVacancy = 1.3;         // in empty circles of the hexagonal lattice
constexpr double kOnSurface = 1e-6;      // spacings
constexpr int kCountRounds = 40;
constexpr std::size_t kLookedAt = 64;  // particles for each one to add or take away
constexpr int kMaxRounds = 64;
constexpr int kShakes = 3;  // different strengths

using enum RelaxOptions::Kernel;
constexpr RelaxOptions kSoft{.kernel = Smooth, .reach = 2, .steps = 30, .momentum = 0.9};
constexpr RelaxOptions kHard{.kernel = Contact, .reach = 0.92, .steps = 25, .momentum = 0, .step = 0.3};

/// What is wrong about a particle; above 1 is a fault.
struct Fault {
  double size = 0;
  bool hole = false;                                 // an empty circle, not a close pair
  bool bent = false;                                 // the surface turns within the cell
  Vec3 place = Vec3::Zero(), normal = Vec3::Zero();  // of that circle or of the farthest corner of the cell
  double room = 0;                                   // area of the cell in spacings squared
  double gap = 0;                                    // its empty circle, in spacings
};

enum class Kind {
  Shake,   // displaces the particles of the patch at random
  Change,  // fills the hole, or removes one of the pair
  Fill,
  Remove,
};

/// One site of a round and the particles about it. Slots are numbers in the round's own arrays.
struct Round {
  std::vector<std::uint32_t> center;  // of each patch: particle
  std::vector<std::uint32_t> member;  // of each slot: particle,
  std::vector<std::uint32_t> patch;   // its patch,
  std::vector<double> distance;       // and how far it is from the centre, in spacings
  SurfacePoints points;
  std::vector<double> spacing;

  void add(std::uint32_t particle, std::uint32_t k, double d, const Vec3& x, const Vec3& n, double s) {
    member.push_back(particle);
    patch.push_back(k);
    distance.push_back(d);
    points.push_back(x, n);
    spacing.push_back(s);
  }
};

class Mending {
 public:
  Mending(const field::Field& surface, const Box& box, const MendOptions& options, Population& population,
          const RunControl& run)
      : surface_(surface), box_(box), options_(options), p_(population), run_(run) {}

  Mended result() {
    const double widest = *std::max_element(p_.spacing.begin(), p_.spacing.end());
    project(surface_, box_, {.tolerance = kOnSurface * widest, .max_distance = widest}, p_.points, run_);
    p_.near.refresh(p_.points, p_.spacing, run_);
    faults_ = judged(p_.points, p_.spacing, p_.near.lists(), {});
    if (options_.leaves_vacancies && many_vacancies()) return {.done = false, .faults = faults()};
    tries_.assign(p_.points.size(), 0);
    repair(Kind::Change);
    if (options_.count && reach(*options_.count)) {
      std::fill(tries_.begin(), tries_.end(), 0U);
      repair(Kind::Shake);
    }
    return {.done = true, .faults = faults()};
  }

 private:
  template <class Which>
  std::size_t count(const Which& which) const {
    return static_cast<std::size_t>(std::count_if(faults_.begin(), faults_.end(), which));
  }
  std::size_t faults() const {
    return count([](const Fault& f) { return f.size > 1; });
  }

  bool many_vacancies() const {
    const auto vacancy = [&](const Fault& f) { return f.hole && f.size > kVacancy / options_.cover; };
    return count([&](const Fault& f) { return vacancy(f) && f.bent; }) > 0 ||
           static_cast<double>(count(vacancy)) > kManyVacancies * static_cast<double>(faults_.size());
  }

  /// Shakes patches about the worst faults and, in every second round, does what `other` says.
  void repair(Kind other) {
    for (int round = 0; round < kMaxRounds; ++round) {
      const std::vector<std::uint32_t> worst = worst_first();
      if (worst.empty()) break;
      patch_ = round < kNarrowRounds ? kPatch : kWidePatch;
      attempt(sites(worst, worst.size()), round % 2 == 0 ? Kind::Shake : other);
    }
  }

  /// The worst fault of every particle, or of those that are asked for.
  std::vector<Fault> judged(const SurfacePoints& points, std::span<const double> spacing, const Neighbours& near,
                            std::span<const std::uint8_t> asked) const {
    const std::vector<CellMeasure> cells = measure_cells(points, spacing, near, box_, run_, asked);
    std::vector<Fault> out(cells.size());
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const double close = options_.packing * cells[i].local_spacing / cells[i].nearest;
      out[i].size = close * close;  // a close pair makes slivers, a hole but larger triangles: what it lacks counts twice
      out[i].place = cells[i].corner;
      out[i].normal = points.normal(i);
      out[i].room = cells[i].area / (cells[i].share * spacing[i] * spacing[i]);
      out[i].gap = cells[i].open || cells[i].bent ? 0 : cells[i].farthest / cells[i].local_spacing;
    }
    const double lattice = options_.cover / std::sqrt(3.0);
    for (const Hole& h : find_holes(surface_, box_, points, spacing, near, cells, lattice, run_))
      if (Fault& f = out[h.particle]; h.radius / lattice > f.size)
        f = {h.radius / lattice, true, cells[h.particle].bent, h.center, h.normal, f.room, h.radius};
    return out;
  }

  /// Faults that have attempts left, those tried less often before, then by falling size.
  std::vector<std::uint32_t> worst_first() const {
    std::vector<std::uint32_t> order;
    for (std::uint32_t i = 0; i < faults_.size(); ++i)
      if (faults_[i].size > 1 && tries_[i] < options_.attempts) order.push_back(i);
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return tries_[a] < tries_[b] || (tries_[a] == tries_[b] && faults_[a].size > faults_[b].size);
    });
    return order;
  }

  /// Up to `count` particles so far apart that their patches can be treated at once, and the particles about them.
  Round sites(const std::vector<std::uint32_t>& order, std::size_t count) {
    Round r;
    const double widest = *std::max_element(p_.spacing.begin(), p_.spacing.end());
    const double ring = patch_ + kFelt;
    PointHash hash(box_.center(), ring * widest), around = hash;
    for (const std::uint32_t i : order) {
      if (r.center.size() == count) break;
      const Vec3 x = p_.points.position(i);
      const double apart = 2 * ring * p_.spacing[i];
      if (hash.any_near(x, 2 * ring * widest,
                        [&](std::uint32_t k) { return (p_.points.position(r.center[k]) - x).norm() < apart; }))
        continue;
      hash.insert(x);
      r.center.push_back(i);
      // In every cell that the patch can reach, so that each particle has to look into its own cell only.
      for (int k = 0; k < 27; ++k) {
        const int row = k / 3, layer = k / 9;
        around.insert(x + ring * widest * Vec3(k % 3 - 1, row % 3 - 1, layer - 1));
      }
    }
    for (std::uint32_t i = 0; i < p_.points.size(); ++i) {
      const Vec3 x = p_.points.position(i);
      around.any_near(x, 0, [&](std::uint32_t copy) {
        const std::uint32_t k = copy / 27, c = r.center[k];
        const double d = (p_.points.position(c) - x).norm() / p_.spacing[c];
        if (d > ring) return false;
        r.add(i, k, d, x, p_.points.normal(i), p_.spacing[i]);
        if (d < patch_) ++tries_[i];
        return true;
      });
    }
    return r;
  }

  /// Does to every patch what `kind` says, relaxes it, and keeps the outcome where it is better (for Fill and Remove, where
  /// it brings no new fault). Returns the change in number.
  std::ptrdiff_t attempt(Round r, Kind kind) {
    std::vector<std::uint8_t> fills(r.center.size()), removes(r.center.size());
    for (std::size_t k = 0; k < r.center.size(); ++k) {
      const bool hole = faults_[r.center[k]].hole;
      fills[k] = kind == Kind::Fill || (kind == Kind::Change && hole);
      removes[k] = kind == Kind::Remove || (kind == Kind::Change && !hole);
    }
    if (kind == Kind::Shake) shake(r);
    const std::size_t old = r.member.size();
    const std::size_t n = p_.points.size();
    for (std::uint32_t k = 0; k < r.center.size(); ++k)
      if (fills[k] && n + (r.member.size() - old) < options_.max_count)
        r.add(static_cast<std::uint32_t>(n + (r.member.size() - old)), k, 0, faults_[r.center[k]].place,
              faults_[r.center[k]].normal, p_.spacing[r.center[k]]);
    std::vector<std::uint32_t> stays;
    for (std::uint32_t s = 0; s < r.member.size(); ++s)
      if (!(removes[r.patch[s]] && r.member[s] == r.center[r.patch[s]])) stays.push_back(s);
    SurfacePoints points = r.points.gathered(stays);
    const std::vector<double> spacing = gathered(r.spacing, stays);
    std::vector<std::uint8_t> movable(stays.size());
    for (std::size_t s = 0; s < stays.size(); ++s) movable[s] = r.distance[stays[s]] < patch_;
    relax(surface_, box_, points, spacing, kSoft, run_, movable);
    relax(surface_, box_, points, spacing, kHard, run_, movable);
    const double widest = *std::max_element(spacing.begin(), spacing.end());
    const auto arrived = project(surface_, box_, {.tolerance = kOnSurface * widest, .max_distance = widest}, points, run_);
    // Cells near the rim of a patch lack neighbours; those of fixed particles beside movable ones do not.
    std::vector<std::uint8_t> asked(stays.size());
    for (std::size_t s = 0; s < stays.size(); ++s) asked[s] = r.distance[stays[s]] < patch_ + kJudged;
    const std::vector<Fault> now = judged(points, spacing, cell_neighbours(points, spacing, run_), asked);

    std::vector<double> before(r.center.size(), 0.0), after = before;
    for (std::size_t s = 0; s < old; ++s)
      if (r.distance[s] < patch_ + kJudged) before[r.patch[s]] = std::max(before[r.patch[s]], faults_[r.member[s]].size);
    for (std::size_t s = 0; s < stays.size(); ++s)
      if (asked[s]) {
        double& a = after[r.patch[stays[s]]];
        a = std::max(a, arrived[s] ? now[s].size : std::numeric_limits<double>::infinity());
      }
    const bool forced = kind == Kind::Fill || kind == Kind::Remove;
    const auto better = [&](std::uint32_t k) {
      return after[k] < before[k] || (forced && after[k] <= std::max(1.0, before[k]));
    };
    return keep(r, stays, points, now, old, better, removes);
  }

  void shake(Round& r) {
    ++shakes_;
    const double strength = kShake * (0.5 + 0.5 * static_cast<double>(shakes_ % kShakes));
    for (std::size_t s = 0; s < r.member.size(); ++s) {
      if (r.distance[s] >= patch_) continue;
      Vec3 u, v;
      tangent_frame(r.points.normal(s), u, v);
      const auto random = random_uniform(run_.seed(), r.member[s], shakes_);
      const double far = strength * r.spacing[s] * std::sqrt(random[0]) * (1 - r.distance[s] / patch_);
      const double angle = 2 * std::numbers::pi * random[1];
      r.points.set_position(s, r.points.position(s) + far * (std::cos(angle) * u + std::sin(angle) * v));
    }
  }

  template <class Better>
  std::ptrdiff_t keep(const Round& r, const std::vector<std::uint32_t>& stays, const SurfacePoints& points,
                      const std::vector<Fault>& now, std::size_t old, const Better& better,
                      const std::vector<std::uint8_t>& removes) {
    const std::size_t n = p_.points.size();
    for (std::size_t s = 0; s < stays.size(); ++s) {
      const std::uint32_t slot = stays[s], k = r.patch[slot];
      if (!better(k) || r.distance[slot] >= patch_ + kJudged) continue;
      std::size_t i = r.member[slot];
      if (slot >= old) {  // a newcomer
        i = p_.points.size();
        p_.push_back(points.position(s), points.normal(s), r.spacing[slot]);
        faults_.push_back(now[s]);
        tries_.push_back(tries_[r.center[k]]);
      }
      p_.points.set_position(i, points.position(s));
      p_.points.set_normal(i, points.normal(s));
      faults_[i] = now[s];
    }
    p_.near = Surroundings();
    std::vector<std::uint8_t> gone(p_.points.size(), 0);
    for (std::uint32_t k = 0; k < r.center.size(); ++k) gone[r.center[k]] = removes[k] && better(k);
    if (std::find(gone.begin(), gone.end(), 1) != gone.end()) drop(gone);
    return static_cast<std::ptrdiff_t>(p_.points.size()) - static_cast<std::ptrdiff_t>(n);
  }

  void drop(const std::vector<std::uint8_t>& gone) {
    std::vector<std::uint32_t> kept;
    for (std::uint32_t i = 0; i < gone.size(); ++i)
      if (!gone[i]) kept.push_back(i);
    p_ = p_.gathered(kept);
    faults_ = gathered(faults_, kept);
    tries_ = gathered(tries_, kept);
  }

  /// Adds particles in the largest empty circles or takes them from the smallest cells, patch by patch. Returns whether any.
  bool reach(std::size_t count) {
    int round = 0;
    for (; round < kCountRounds && p_.points.size() != count; ++round) {
      const bool fill = p_.points.size() < count;
      const std::size_t missing = fill ? count - p_.points.size() : p_.points.size() - count;
      const auto key = [&](std::uint32_t i) { return fill ? -faults_[i].gap : faults_[i].room; };
      std::vector<std::uint32_t> order(p_.points.size());
      std::iota(order.begin(), order.end(), 0U);
      const auto looked_at = static_cast<std::ptrdiff_t>(std::min(order.size(), kLookedAt * missing));
      // What failed before comes last.
      std::partial_sort(order.begin(), order.begin() + looked_at, order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return std::make_tuple(tries_[a], key(a), a) < std::make_tuple(tries_[b], key(b), b);
      });
      order.resize(static_cast<std::size_t>(looked_at));
      attempt(sites(order, missing), fill ? Kind::Fill : Kind::Remove);
    }
    return round > 0;
  }

  const field::Field& surface_;
  const Box& box_;
  const MendOptions& options_;
  Population& p_;
  const RunControl& run_;
  std::vector<Fault> faults_;
  std::vector<std::uint32_t> tries_;
  std::uint64_t shakes_ = 0;
  double patch_ = kPatch;  // of the round
};

}  // namespace

Mended mend(const field::Field& surface, const Box& box, const MendOptions& options, Population& population,
            const RunControl& run) {
  if (population.points.empty()) return {};
  return Mending(surface, box, options, population, run).result();
}

}  // namespace meniscus::sample
