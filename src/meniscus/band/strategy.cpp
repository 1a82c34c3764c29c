#include <meniscus/band/strategy.h>
#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace meniscus::band {

Target::Target(const field::Field& field, double rate, double reach) : field_(field), rate_(rate), reach_(reach) {
  if (!(rate > 0) || !(reach > 0)) throw InvalidInput("a target needs a positive rate and reach");
}

void Target::add_speed(const SurfaceSamples& at, std::span<double> speed, const RunControl& run) {
  parallel_blocks(speed.size(), field::kBlock, run, [&](std::size_t begin, std::size_t end) {
    field::JetBatch jets(end - begin, field::Order::Gradient);
    field_.evaluate(at.crossings.x.view().part(begin, end - begin), jets.view());
    for (std::size_t i = begin; i < end; ++i) {
      const double f = jets.value(i - begin), slope = jets.gradient(i - begin).norm();
      // Where the field is flat (outside a compact blob's support) the distance is unknown but large.
      const double distance = std::abs(f) < reach_ * slope ? f / slope : std::copysign(reach_, f);
      speed[i] -= rate_ * (std::isnan(f) ? f : distance);
    }
  });
}

HoldArea::HoldArea(double goal, double speed) : goal_(goal), speed_(speed) {
  if (!(goal > 0) || !std::isfinite(speed)) throw InvalidInput("an area to hold must be positive");
}

void HoldArea::add_speed(const SurfaceSamples& at, std::span<double> speed, const RunControl&) {
  double area = 0;
  for (const Component& c : at.components) area += c.area;
  for (double& v : speed) v += speed_ * (goal_ - area) / goal_;
}

double HoldArea::max_step() const {
  const double radius = std::sqrt(goal_ / (4 * std::numbers::pi));
  return speed_ != 0 ? 0.25 * radius / std::abs(speed_) : Strategy::max_step();
}

void HoldVolume::add_speed(const SurfaceSamples& at, std::span<double> speed, const RunControl&) {
  // A crossing stands for an area in proportion to 1/(|n_x|+|n_y|+|n_z|): so many edges cross a piece of that slope.
  struct Mean {
    double flow = 0, area = 0;
  };
  std::vector<Mean> mean(at.components.size());
  for (std::size_t i = 0; i < speed.size(); ++i) {
    if (at.component[i] < 0) continue;
    Mean& m = mean[static_cast<std::size_t>(at.component[i])];
    const double w = 1 / std::max(at.crossings.normal[i].lpNorm<1>(), 1.0);
    m.flow += w * speed[i];
    m.area += w;
  }
  for (std::size_t i = 0; i < speed.size(); ++i) {
    if (at.component[i] < 0) continue;
    const auto c = static_cast<std::size_t>(at.component[i]);
    const Component& part = at.components[c];
    if (!part.goal || !(part.area > 0) || !(mean[c].area > 0)) continue;
    const double missing = std::clamp((*part.goal - part.volume) / part.area, -0.25 * at.voxel, 0.25 * at.voxel);
    speed[i] += missing / at.step - mean[c].flow / mean[c].area;
  }
}

void Carry::add_speed(const SurfaceSamples& at, std::span<double> speed, const RunControl& run) {
  field::PositionBatch u(speed.size());
  parallel_blocks(speed.size(), field::kBlock, run, [&](std::size_t begin, std::size_t end) {
    field_.material_velocity(at.crossings.x.view().part(begin, end - begin),
                             {u.x.data() + begin, u.y.data() + begin, u.z.data() + begin});
  });
  for (std::size_t i = 0; i < speed.size(); ++i) speed[i] += at.crossings.normal[i].dot(Vec3(u.x[i], u.y[i], u.z[i]));
}

}  // namespace meniscus::band
