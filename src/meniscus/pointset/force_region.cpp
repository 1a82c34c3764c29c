#include <meniscus/pointset/force_region.h>

#include <meniscus/base/parallel.h>

#include <algorithm>
#include <cmath>

namespace meniscus::pointset {
namespace {

constexpr std::size_t kBlock = 1024;
constexpr double kMargin = 0.5;  // of the tool's radius: room for the springs about the tool
constexpr double kSight = 1.7;   // of a point's reach: where its samples can be, with room to move

double widest_reach(const PointSet& set, const Box& box) {
  double widest = 0;
  for (std::size_t i = 0; i < set.size(); ++i)
    if (box.contains(set.position(i))) widest = std::max(widest, set.reach[i]);
  return widest;
}

SculptGrid grid_about(const PointSetField& field, const Stroke& stroke, const ToolShape& shape) {
  const double margin = kMargin * stroke.radius + 2 * widest_reach(field.set(), shape.bounds());
  Stroke single = stroke;
  single.mirror = {};
  const double voxel = ToolShape(single).bounds().padded(margin).size().maxCoeff() / (stroke.voxels - 1);
  const Box region = shape.bounds().padded(margin);
  Material material = stroke.material;
  material.stiffness *= stroke.radius * stroke.radius;
  const double wanted = std::ceil(region.size().maxCoeff() / voxel - 1e-9) + 1;
  return {region, static_cast<int>(std::clamp(wanted, 8.0, 512.0)), material};
}

}  // namespace

ForceRegion::ForceRegion(const PointSetField& field, const Stroke& stroke, const ToolShape& shape, int steps,
                         const RunControl& run)
    : stroke_(stroke), grid_(grid_about(field, stroke, shape)), profile_(grid_.size()) {
  parallel_for(grid_.size(), kBlock, run, [&](std::size_t i) {
    const Vec3 x = grid_.position(i);
    profile_[i] = static_cast<float>(shape.weight(x));
    if (stroke.region && !stroke.region->contains(x)) grid_.hold(i);
  });
  sample(field, run);
  // What a force of one does tells what force does as much as is wanted.
  for (int k = 0; k < steps; ++k) grid_.step(stroke.seconds / steps, run);
  double most = 0;
  for (const float d : grid_.deviation()) most = std::max(most, std::abs(static_cast<double>(d)));
  factor_ = most > 0 ? stroke.strength / most : 0;
  grid_.reset();
  load(factor_);
}

// −(f·∇s): along the normals it is −|f|, |∇s| being about 1.
void ForceRegion::load(double factor) {
  const auto n = grid_.count();
  const std::size_t next[3] = {static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]),
                               static_cast<std::size_t>(n[2]), 1};
  const Vec3 along = stroke_.direction ? stroke_.direction->normalized() : Vec3::Zero();
  const auto d = grid_.value();
  for (std::size_t i = 0; i < grid_.size(); ++i) {
    double slope = 1;
    if (stroke_.direction) {
      slope = 0;
      bool known = i >= next[0] && i + next[0] < grid_.size() && near_[i];
      for (int a = 0; known && a < 3; ++a) {
        known = near_[i - next[a]] && near_[i + next[a]];
        slope +=
            along[a] * (static_cast<double>(d[i + next[a]]) - static_cast<double>(d[i - next[a]])) / (2 * grid_.voxel());
      }
      slope = known ? std::clamp(slope, -1.0, 1.0) : 0;
    }
    grid_.load()[i] = static_cast<float>(-factor * slope * static_cast<double>(profile_[i]));
  }
}

void ForceRegion::sample(const PointSetField& field, const RunControl& run) {
  near_.assign(grid_.size(), 0);
  const auto n = grid_.count();
  const PointSet& set = field.set();
  for (std::size_t p = 0; p < set.size(); ++p) {
    const double sight = kSight * set.reach[p] + 2 * grid_.voxel();
    const Box box = Box::around(set.position(p), sight).intersection(grid_.bounds());
    if (box.empty()) continue;
    int low[3], high[3];
    for (int a = 0; a < 3; ++a) {
      low[a] = static_cast<int>(std::ceil((box.min[a] - grid_.bounds().min[a]) / grid_.voxel() - 1e-9));
      high[a] = std::min(n[static_cast<std::size_t>(a)] - 1,
                         static_cast<int>((box.max[a] - grid_.bounds().min[a]) / grid_.voxel() + 1e-9));
    }
    for (int i = low[0]; i <= high[0]; ++i)
      for (int j = low[1]; j <= high[1]; ++j)
        std::fill_n(near_.begin() + (static_cast<std::ptrdiff_t>(i) * n[1] + j) * n[2] + low[2], high[2] - low[2] + 1, 1);
  }
  std::vector<std::size_t> voxels;
  for (std::size_t i = 0; i < near_.size(); ++i)
    if (near_[i]) voxels.push_back(i);
  field::PositionBatch x(voxels.size());
  for (std::size_t k = 0; k < voxels.size(); ++k) x.set(k, grid_.position(voxels[k]));
  field::JetBatch jets(voxels.size(), field::Order::Value);
  field::evaluate(field, x.view(), jets.view(), run);
  std::vector<double> values(grid_.size(), 0.0);
  for (std::size_t k = 0; k < voxels.size(); ++k)
    values[voxels[k]] = jets.value(k) - static_cast<double>(grid_.deviation()[voxels[k]]);
  grid_.set_base(values);
  load(factor_);
}

double ForceRegion::largest_change(const PointSet& set, const std::vector<std::uint32_t>& points,
                                   std::span<const float> since) const {
  double largest = 0;
  for (const std::uint32_t i : points) {
    const auto cell = grid_.cell(set.position(i));
    largest = std::max(largest, std::abs(grid_.at(cell, grid_.deviation()) - grid_.at(cell, since)));
  }
  return largest;
}

}  // namespace meniscus::pointset
