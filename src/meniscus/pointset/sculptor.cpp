#include <meniscus/pointset/sculptor.h>

#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>
#include <meniscus/points/spacing.h>
#include <meniscus/pointset/force_region.h>
#include <meniscus/pointset/grid_update.h>
#include <meniscus/pointset/resample.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace meniscus::pointset {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kStage = 0.4;  // of the least reach: how far a stage moves the surface
constexpr int kMostStages = 4096;
constexpr int kFillPasses = 4;  // each closes most of the gaps
constexpr int kRefinePasses = 24;
constexpr int kProjectionSteps = 6;
constexpr int kSmoothings = 10;
constexpr std::size_t kSmoothNeighbours = 12;
constexpr double kPinch = 0.3;  // Crease: how much nearer to the path, at most

double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

std::vector<std::uint32_t> flagged(const std::vector<char>& flags) {
  std::vector<std::uint32_t> indices;
  for (std::size_t i = 0; i < flags.size(); ++i)
    if (flags[i]) indices.push_back(static_cast<std::uint32_t>(i));
  return indices;
}

/// Points from `first` on get identities of their own, if points have them.
void give_new_ids(PointSet& set, std::size_t first) {
  const auto ids = set.attributes.integers(attribute::kId);
  if (ids.empty()) return;
  std::vector<std::int64_t> all(ids.begin(), ids.end());
  std::int64_t next = *std::max_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(first)) + 1;
  for (std::size_t i = first; i < all.size(); ++i) all[i] = next++;
  set.attributes.set_integers(attribute::kId, 1, std::move(all));
}

/// In how many stages a motion of that length is made.
int stages_for(double length, double reach) {
  return static_cast<int>(std::clamp(std::ceil(length / (kStage * reach)), 1.0, static_cast<double>(kMostStages)));
}

}  // namespace

struct Sculptor::Work {
  RunControl run;
  OnStep step;
  StrokeReport report;
  std::vector<std::uint32_t> origin;  // numbers before the stroke of the points that were there
};

Sculptor::Sculptor(PointSet set, const SculptorOptions& options)
    : field_(std::move(set)),
      options_(options),
      spacing_(options.spacing.value_or(points::typical_spacing(to_cloud(this->set())))) {
  if (options.spacing && (!(*options.spacing > 0) || !std::isfinite(*options.spacing)))
    throw InvalidInput("the spacing of sculpted points must be above 0");
}

StrokeReport Sculptor::apply(const Stroke& stroke, const RunControl& run) {
  return apply(
      stroke, [](const PointSet&) {}, run);
}

StrokeReport Sculptor::apply(const Stroke& stroke, OnStep on_step, const RunControl& run) {
  check(stroke);
  const auto start = Clock::now();
  const PointSet before = set();
  const double spacing_before = spacing_;
  Work work{run, on_step, {}, std::vector<std::uint32_t>(before.size())};
  std::iota(work.origin.begin(), work.origin.end(), std::uint32_t{0});
  try {
    make(stroke, work);
  } catch (...) {
    field_.edit() = before;
    field_.refresh();
    spacing_ = spacing_before;
    throw;
  }
  Delta delta(before, set(), work.origin);
  StrokeReport& report = work.report;
  report.points = set().size();
  report.moved = delta.changed();
  report.inserted = delta.added();
  report.removed = delta.removed();
  history_.resize(done_);
  history_.push_back({std::move(delta), spacing_before, spacing_});
  ++done_;
  report.seconds_points = since(start) - report.seconds_dynamics;
  return report;
}

bool Sculptor::undo() {
  if (done_ == 0) return false;
  const Done& last = history_[--done_];
  last.delta.undo(field_.edit());
  spacing_ = last.spacing_before;
  field_.refresh();
  return true;
}

bool Sculptor::redo() {
  if (done_ == history_.size()) return false;
  const Done& next = history_[done_++];
  next.delta.redo(field_.edit());
  spacing_ = next.spacing_after;
  field_.refresh();
  return true;
}

void Sculptor::make(const Stroke& stroke, Work& work) {
  const ToolShape shape(stroke);
  switch (stroke.tool) {
    case Stroke::Tool::Force: return force(stroke, shape, work);
    case Stroke::Tool::Smooth: return smooth(stroke, shape, work);
    case Stroke::Tool::Emboss: return emboss(stroke, shape, work);
    case Stroke::Tool::Refine: spacing_ = stroke.spacing; return refine(shape, work);
    case Stroke::Tool::Inflate:
    case Stroke::Tool::Flatten:
    case Stroke::Tool::Crease:
    case Stroke::Tool::Drag: return brush(stroke, shape, work);
  }
}

double Sculptor::least_reach(const ToolShape& shape) const {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < set().size(); ++i)
    if (shape.bounds().contains(set().position(i))) least = std::min(least, set().reach[i]);
  return least;
}

void Sculptor::stage(const ValueChange& change, Work& work) {
  ++work.report.stages;
  const std::vector<Conformed> found = conform(field_, change, work.run);
  std::vector<char> changed(set().size(), 0), gone(set().size(), 0);
  PointSet& points = field_.edit();
  for (const Conformed& c : found) {
    if (c.lost) {
      gone[c.index] = 1;
      ++work.report.lost;
      continue;
    }
    points.set_position(c.index, c.position);
    points.set_normal(c.index, c.normal);
    changed[c.index] = 1;
  }
  settle(std::move(changed), std::move(gone), work);
  work.step(set());
}

namespace {

/// Removes points, and their flags and origins with them; flags the neighbours they leave.
void remove(PointSet& set, const points::NeighbourSearch& search, const std::vector<char>& gone, std::vector<char>& changed,
            std::vector<std::uint32_t>& origin) {
  std::vector<points::Neighbour> near;
  std::vector<std::size_t> kept;
  std::vector<std::uint32_t> kept_origin;
  for (std::size_t i = 0; i < gone.size(); ++i) {
    if (!gone[i]) {
      kept.push_back(i);
      if (i < origin.size()) kept_origin.push_back(origin[i]);
      continue;
    }
    search.within(set.position(i), set.reach[i], near);
    for (const points::Neighbour& n : near) changed[n.index] = 1;
  }
  if (kept.size() == gone.size()) return;
  if (kept.empty()) throw InvalidInput("the stroke leaves no point of the surface");
  for (std::size_t k = 0; k < kept.size(); ++k) changed[k] = changed[kept[k]];
  changed.resize(kept.size());
  set.keep(kept);
  origin = std::move(kept_origin);
}

}  // namespace

// Brings the set back in order after points have moved.
void Sculptor::settle(std::vector<char> changed, std::vector<char> gone, Work& work) {
  if (std::find(changed.begin(), changed.end(), 1) == changed.end() && std::find(gone.begin(), gone.end(), 1) == gone.end())
    return;
  work.run.check();
  PointSet& points = field_.edit();
  remove(points, points::NeighbourSearch(positions(points)), gone, changed, work.origin);
  if (options_.resample) {
    const points::NeighbourSearch search(positions(points));
    gone.assign(points.size(), 0);
    for (const std::uint32_t i : find_crowded(points, search, flagged(changed), spacing_)) gone[i] = 1;
    remove(points, search, gone, changed, work.origin);
  }
  refit_around(changed, work);
  for (int pass = 0; options_.resample && pass < kFillPasses; ++pass)
    if (!fill_gaps(changed, work)) break;
}

// Fits the changed points and all whose domains see one of them; these are flagged then too.
void Sculptor::refit_around(std::vector<char>& changed, Work& work) {
  PointSet& points = field_.edit();
  const points::NeighbourSearch search(positions(points));
  std::vector<points::Neighbour> near;
  for (const std::uint32_t i : flagged(changed)) {
    search.within(points.position(i), points.reach[i], near);
    for (const points::Neighbour& n : near) changed[n.index] = 1;
  }
  std::vector<std::size_t> touched;
  for (const std::uint32_t i : flagged(changed)) touched.push_back(i);
  refit(points, touched, search, options_.fit, work.run);
  field_.refresh();
}

// Inserts points in the gaps about the flagged ones; says whether there were any. Then the new ones and those about them are
// flagged.
bool Sculptor::fill_gaps(std::vector<char>& changed, Work& work) {
  PointSet& points = field_.edit();
  const points::NeighbourSearch search(positions(points));
  std::vector<Gap> gaps = find_gaps(points, search, flagged(changed), spacing_, work.run);
  if (points.size() + gaps.size() > options_.most_points) {
    work.report.full = true;
    gaps.resize(options_.most_points - std::min(options_.most_points, points.size()));
  }
  if (gaps.empty()) return false;

  std::vector<Vec3> places;
  for (const Gap& g : gaps) places.push_back(g.place);
  for (int k = 0; k < kProjectionSteps; ++k) {
    const field::JetBatch jets = field::evaluate(field_, places, field::Order::Gradient, work.run);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Vec3 g = jets.gradient(i);
      if (g.squaredNorm() > 0) places[i] -= jets.value(i) / g.squaredNorm() * g;
    }
  }
  const field::JetBatch jets = field::evaluate(field_, places, field::Order::Gradient, work.run);
  std::vector<PointRecord> records;
  std::vector<std::size_t> like;
  std::vector<points::Neighbour> near;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double slope = jets.gradient(i).norm();
    if (!(std::abs(jets.value(i)) < 1e-3 * spacing_ * slope) || !((places[i] - gaps[i].place).norm() < spacing_)) continue;
    search.nearest(places[i], 1, near);
    if (near.empty() || near[0].squared_distance < std::pow(0.5 * spacing_, 2)) continue;
    PointRecord record = points.record(gaps[i].like);
    record.position = places[i];
    record.normal = jets.gradient(i) / slope;
    record.border.setZero();
    records.push_back(std::move(record));
    like.push_back(gaps[i].like);
  }
  if (records.empty()) return false;
  const std::size_t first = points.size();
  points.append(records, like);
  give_new_ids(points, first);
  changed.assign(points.size(), 0);
  std::fill(changed.begin() + static_cast<std::ptrdiff_t>(first), changed.end(), 1);
  refit_around(changed, work);
  return true;
}

void Sculptor::refine(const ToolShape& shape, Work& work) {
  PointSet& points = field_.edit();
  std::vector<char> changed(points.size(), 0), gone(points.size(), 0);
  const auto flag = [&] {
    changed.assign(points.size(), 0);
    for (std::size_t i = 0; i < points.size(); ++i) changed[i] = shape.weight(points.position(i)) > 0;
  };
  flag();
  const points::NeighbourSearch search(positions(points));
  for (const std::uint32_t i : find_crowded(points, search, flagged(changed), spacing_)) gone[i] = 1;
  remove(points, search, gone, changed, work.origin);
  flag();
  if (work.origin.size() < gone.size()) refit_around(changed, work);
  for (int pass = 0; pass < kRefinePasses; ++pass) {
    if (!fill_gaps(changed, work)) break;
    ++work.report.stages;
    work.step(set());
    flag();
  }
}

// Points follow the grid step by step; before they are out of sight of where the values were sampled, the change so far is
// made for good, and the grid goes on from there with its motion.
void Sculptor::force(const Stroke& stroke, const ToolShape& shape, Work& work) {
  const double reach = least_reach(shape);
  if (!std::isfinite(reach) || stroke.strength == 0) return;
  const int steps = std::max(stroke.steps, stages_for(2 * std::abs(stroke.strength), reach));
  const double h = stroke.seconds / steps;
  ForceRegion region(field_, stroke, shape, steps, work.run);
  SculptGrid& grid = region.grid();
  work.report.voxels = grid.size();

  std::vector<float> since_stage(grid.size(), 0.0F);
  PointSet shown = set();
  std::vector<std::uint32_t> inside = points_inside(shown, grid.bounds());
  for (int k = 0; k < steps; ++k) {
    work.run.check();
    const auto start = Clock::now();
    grid.step(h, work.run);
    work.report.seconds_dynamics += since(start);
    follow_grid(shown, inside, grid, h, work.run);
    const bool last = k + 1 == steps;
    if (!last && region.largest_change(set(), inside, since_stage) < kStage * reach) {
      work.step(shown);
      continue;
    }
    stage(GridChange(grid, since_stage), work);
    if (last) break;
    since_stage.assign(grid.deviation().begin(), grid.deviation().end());
    region.sample(field_, work.run);
    shown = set();
    inside = points_inside(shown, grid.bounds());
  }
}

void Sculptor::brush(const Stroke& stroke, const ToolShape& shape, Work& work) {
  const double reach = least_reach(shape);
  if (!std::isfinite(reach)) return;
  if (stroke.tool == Stroke::Tool::Inflate) {
    const int n = stages_for(std::abs(stroke.strength), reach);
    for (int k = 0; k < n; ++k) stage(Raise(shape, stroke.strength / n), work);
    return;
  }
  if (stroke.tool == Stroke::Tool::Crease) {
    const int n = std::max(stages_for(std::abs(stroke.strength), reach), stages_for(kPinch * stroke.radius * 0.5, reach));
    for (int k = 0; k < n; ++k) stage(Crease(shape, stroke.strength / n, kPinch / n), work);
    return;
  }
  if (stroke.tool == Stroke::Tool::Drag) {
    // The tool goes along with what it holds. A map that moves things by half its own width would fold.
    const Vec3 way = stroke.strength * stroke.direction->normalized();
    const int n = std::max(stages_for(way.norm(), reach), stages_for(way.norm(), 0.5 * stroke.radius));
    Stroke moving = stroke;
    for (int k = 0; k < n; ++k) {
      const ToolShape here(moving);
      stage(Carry(here, way / n), work);
      for (Vec3& p : moving.path) p += way / n;
    }
    return;
  }
  // Flatten: towards the mean plane of what lies under the tool, by shares that add up.
  Stroke single = stroke;
  single.mirror = {};
  const ToolShape here(single);
  Vec3 place = Vec3::Zero(), normal = Vec3::Zero();
  double total = 0;
  for (std::size_t i = 0; i < set().size(); ++i) {
    const double w = here.weight(set().position(i));
    total += w;
    place += w * set().position(i);
    normal += w * set().normal(i);
  }
  if (!(total > 0) || !(normal.norm() > 0)) return;
  place /= total;
  normal.normalize();
  double farthest = 0;
  for (std::size_t i = 0; i < set().size(); ++i) {
    const Vec3 p = set().position(i);
    if (here.weight(p) > 0 && normal.dot(set().normal(i)) > 0)
      farthest = std::max(farthest, std::abs(normal.dot(p - place)));
  }
  const int n = stages_for(stroke.strength * farthest * 2, reach);
  const double share = stroke.strength < 1 ? 1 - std::pow(1 - stroke.strength, 1.0 / n) : 1 - std::pow(0.01, 1.0 / n);
  for (int k = 0; k < n; ++k) stage(Flatten(shape, place, normal, share), work);
}

void Sculptor::smooth(const Stroke& stroke, const ToolShape& shape, Work& work) {
  PointSet& points = field_.edit();
  std::vector<std::uint32_t> touched;
  std::vector<double> weight;
  for (std::uint32_t i = 0; i < points.size(); ++i)
    if (const double w = shape.weight(points.position(i)); w > 0) touched.push_back(i), weight.push_back(w);
  if (touched.empty()) return;
  const points::NeighbourSearch search(positions(points));
  std::vector<std::vector<std::uint32_t>> near(touched.size());
  parallel_for(touched.size(), 64, work.run, [&](std::size_t k) {
    std::vector<points::Neighbour> found;
    search.nearest(points.position(touched[k]), kSmoothNeighbours + 1, found);
    for (const points::Neighbour& n : found)
      if (n.index != touched[k] && points.normal(n.index).dot(points.normal(touched[k])) > 0) near[k].push_back(n.index);
  });
  // A share of the way along the normal to the neighbours' mean plane, and of their mean normal; all at once.
  std::vector<Vec3> place(touched.size()), normal(touched.size());
  const double share = 0.5 * stroke.strength;
  for (int pass = 0; pass < kSmoothings; ++pass) {
    parallel_for(touched.size(), 64, work.run, [&](std::size_t k) {
      const Vec3 p = points.position(touched[k]), n = points.normal(touched[k]);
      Vec3 mean_normal = n;
      double height = 0;
      for (const std::uint32_t j : near[k]) {
        mean_normal += points.normal(j);
        height += n.dot(points.position(j) - p) / static_cast<double>(near[k].size());
      }
      const double w = share * weight[k];
      place[k] = p + w * height * n;
      normal[k] = (n + w * (mean_normal.normalized() - n)).normalized();
    });
    for (std::size_t k = 0; k < touched.size(); ++k) {
      points.set_position(touched[k], place[k]);
      points.set_normal(touched[k], normal[k]);
    }
  }
  std::vector<char> changed(points.size(), 0);
  for (const std::uint32_t i : touched) changed[i] = 1;
  ++work.report.stages;
  settle(std::move(changed), std::vector<char>(points.size(), 0), work);
  work.step(set());
}

void Sculptor::emboss(const Stroke& stroke, const ToolShape& shape, Work& work) {
  // A pixel should be no finer than the points: how wide is the image on the surface?
  double width = stroke.projection.width;
  if (stroke.projection.kind != Projection::Kind::Planar) {
    double distance = 0, count = 0;
    for (std::size_t i = 0; i < set().size(); ++i) {
      if (!(shape.weight(set().position(i)) > 0)) continue;
      distance += (set().position(i) - stroke.projection.origin).norm();
      ++count;
    }
    width *= std::numbers::pi / 180 * distance / std::max(1.0, count);
  }
  if (!(width > 0)) return;
  const GreyImage image = coarsened(*stroke.image, spacing_ / width);
  const int n = stages_for(std::abs(stroke.strength), least_reach(shape));
  for (int k = 0; k < n; ++k) stage(Emboss(shape, image, stroke.projection, stroke.strength / n), work);
}

}  // namespace meniscus::pointset
