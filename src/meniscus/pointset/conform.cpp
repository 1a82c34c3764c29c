#include <meniscus/pointset/conform.h>

#include <meniscus/base/parallel.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace meniscus::pointset {
namespace {

constexpr std::size_t kBlock = 64;
constexpr int kSteps = 10;
// Of the reach.
constexpr double kOffset = 0.05;   // of the differences that give the gradient
constexpr double kFarthest = 0.9;  // from where a point began
constexpr double kLongest = 0.4;   // of one step
constexpr double kSettled = 1e-5;
// |∇s| of a surface is about 1; where it is far less two sheets have met.
constexpr double kLeastSlope = 0.1;

/// A point and the six places about it.
constexpr std::size_t kStar = 7;

/// A block of points on their way.
class Walk {
 public:
  Walk(const PointSetField& field, const ValueChange& change, std::span<Conformed> points)
      : field_(field), change_(change), points_(points), active_(points.size()) {
    for (std::size_t k = 0; k < points.size(); ++k) {
      active_[k] = k;
      starts_.push_back(points[k].position);
    }
  }

  void run() {
    for (int step = 0; step < kSteps && !active_.empty(); ++step) {
      sample();
      std::size_t left = 0;
      for (std::size_t a = 0; a < active_.size(); ++a)
        if (!arrived(a)) active_[left++] = active_[a];
      active_.resize(left);
    }
    for (const std::size_t k : active_) points_[k].lost = true;
  }

 private:
  double reach(std::size_t k) const { return field_.set().reach[points_[k].index]; }

  /// The changed values at the stars of all active points.
  void sample() {
    places_.clear();
    for (const std::size_t k : active_) {
      const Vec3 p = points_[k].position;
      const double offset = kOffset * reach(k);
      places_.push_back(p);
      for (int axis = 0; axis < 3; ++axis)
        for (const double side : {-offset, offset}) places_.push_back(p + side * Vec3::Unit(axis));
    }
    sources_ = places_;
    change_.sources(sources_);
    const field::PositionBatch x(sources_);
    values_.resize(places_.size());
    field_.evaluate(x.view(), {values_.data(), values_.size(), values_.size(), field::Order::Value});
    change_.values(places_, values_);
  }

  /// A step of Newton's method; whether it was the last.
  bool arrived(std::size_t a) {
    const std::size_t k = active_[a];
    Conformed& point = points_[k];
    const double* s = values_.data() + a * kStar;
    const Vec3 gradient = Vec3(s[2] - s[1], s[4] - s[3], s[6] - s[5]) / (2 * kOffset * reach(k));
    const double slope = gradient.norm();
    if (!(slope > kLeastSlope) || (point.position - starts_[k]).norm() > kFarthest * reach(k)) return point.lost = true;
    const double away = std::clamp(s[0] / slope, -kLongest * reach(k), kLongest * reach(k));
    point.position -= away / slope * gradient;
    point.normal = gradient / slope;
    return std::abs(away) < kSettled * reach(k);
  }

  const PointSetField& field_;
  const ValueChange& change_;
  std::span<Conformed> points_;
  std::vector<std::size_t> active_;
  std::vector<Vec3> starts_, places_, sources_;
  std::vector<double> values_;
};

}  // namespace

std::vector<Conformed> conform(const PointSetField& field, const ValueChange& change, const RunControl& run) {
  const PointSet& set = field.set();
  std::vector<Conformed> points;
  for (std::uint32_t i = 0; i < set.size(); ++i)
    if (change.touches(set.position(i), set.normal(i)))
      points.push_back({i, false, change.carried(set.position(i)), set.normal(i)});
  parallel_blocks(points.size(), kBlock, run, [&](std::size_t begin, std::size_t end) {
    Walk(field, change, std::span(points).subspan(begin, end - begin)).run();
  });
  return points;
}

}  // namespace meniscus::pointset
