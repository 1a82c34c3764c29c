#include <meniscus/base/error.h>
#include <meniscus/sample/integrals.h>
#include <meniscus/sample/spread.h>
#include <meniscus/scene/build_field.h>
#include <meniscus/scene/edit_session.h>

#include <algorithm>

namespace meniscus::scene {
namespace {

constexpr double kRestSpacing = 2.017;  // of floaters at rest, in repulsion radii
constexpr double kRoom = 1.2;           // wanted radius over that at the start: radii at rest lie between 0.7 and 1 of it
constexpr std::size_t kGoalPoints = 1000;
constexpr double kGoalTolerance = 1e-3;
constexpr double kPoseSeconds = 0.1;  // in which floaters follow an undo

void add(const sample::FloaterStep& step, sample::FloaterStep& sum) {
  sum.born.insert(sum.born.end(), step.born.begin(), step.born.end());
  sum.died.insert(sum.died.end(), step.died.begin(), step.died.end());
  sum.lost.insert(sum.lost.end(), step.lost.begin(), step.lost.end());
  sum.seeded += step.seeded;
  sum.singular = step.singular;
  sum.moving = step.moving;
  sum.mean_speed = step.mean_speed;
  sum.capped = sum.capped || step.capped;
}

}  // namespace

EditSession::EditSession(Document document, RunControl run)
    : document_(std::move(document)), run_(std::move(run)), surface_(build_field(document_, run_)) {}

Box EditSession::box() const {
  const Box bounds = control::tight_bounds(*surface_);
  return bounds.padded(0.05 * bounds.diameter());
}

points::Cloud EditSession::spread_points(std::size_t count) const {
  const Box where = box();
  if (where.empty()) return {};
  if (!where.finite()) throw InvalidInput("the surface has no bounds: points cannot cover it");
  sample::SpreadOptions options;
  options.count = count;
  return sample::spread(*surface_, where, options, run_).cloud;
}

void EditSession::show_floaters(std::size_t count) {
  const points::Cloud cloud = spread_points(count);
  floaters_.reset();
  if (cloud.empty()) return;
  const auto normals = cloud.attributes.values(attribute::kNormal, 3);
  const auto halves = cloud.attributes.values(attribute::kRadius, 1);
  const auto at_rest = [&](std::size_t i) { return 2 * halves[i] / kRestSpacing; };
  sample::FloaterOptions how;
  how.radius = kRoom * at_rest(0);
  floaters_.emplace(box(), how, run_);
  for (std::size_t i = 0; i < cloud.size(); ++i)
    floaters_->add(cloud.positions[i], {normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]}, at_rest(i));
}

control::ControlSession& EditSession::begin_stroke(control::DragOptions options) {
  return controls_.emplace(*surface_, std::move(options));
}

control::ControlSession& EditSession::controls() {
  if (!controls_) throw InvalidInput("no stroke has begun");
  return *controls_;
}

void EditSession::follow(const field::Field& surface, double dt, sample::FloaterStep& report) {
  const Box where = box();
  if (where.finite() && !where.empty()) floaters_->set_box(where);
  add(floaters_->step(surface, dt), report);
}

EditStep EditSession::advance(double dt, bool to_the_end) {
  EditStep made;
  control::ControlSession& c = controls();
  if (!floaters_) {
    made.control = to_the_end ? c.run(dt) : c.step(dt);
    return made;
  }
  const auto carry = [&](const field::Field& surface, double seconds) { follow(surface, seconds, made.floaters); };
  made.control = to_the_end ? c.run(dt, carry) : c.step(dt, carry);
  return made;
}

EditStep EditSession::step(double dt) { return advance(dt, false); }

EditStep EditSession::run(double dt) { return advance(dt, true); }

control::GoalReport EditSession::reach(control::Measure goal, double target, const std::vector<std::string>& freeze) {
  const auto measure = [&](const field::Field&) {
    control::SurfaceElements e;
    points::Cloud cloud = spread_points(kGoalPoints);
    if (cloud.empty()) return e;
    const sample::SurfaceIntegrals whole = sample::integrate(cloud);
    const auto areas = cloud.attributes.values(sample::attribute::kArea, 1);
    double sum = 0;
    for (const double a : areas) sum += a;
    // The elements lie in tangent planes; together they make up the area that is known better.
    for (const double a : areas) e.areas.push_back(a * whole.area.value / sum);
    e.points = std::move(cloud.positions);
    e.volume = whole.volume.value;
    return e;
  };
  return control::reach(*surface_, goal, target, measure, kGoalTolerance, freeze);
}

void EditSession::end_stroke(const std::string& label) {
  history_.apply(document_, {label, parameter_changes(document_, surface_->parameters())});
  controls_.reset();
}

/// The surface takes the document's numbers; floaters are carried along.
void EditSession::pose_as_written() {
  controls_.reset();
  const std::vector<double> values = parameter_values(document_, surface_->parameters());
  if (floaters_) {
    std::vector<double> now, rates;
    for (const field::Parameter& p : surface_->parameters()) {
      now.push_back(p.value);
      rates.push_back((values[rates.size()] - p.value) / kPoseSeconds);
    }
    surface_->set_parameters(now, rates);
    sample::FloaterStep report;
    follow(*surface_, kPoseSeconds, report);
  }
  surface_->set_parameters(values);
}

bool EditSession::undo() {
  const bool any = history_.undo(document_);
  pose_as_written();
  return any;
}

bool EditSession::redo() {
  const bool any = history_.redo(document_);
  pose_as_written();
  return any;
}

}  // namespace meniscus::scene
