#include <meniscus/base/error.h>
#include <meniscus/field/cpu.h>
#include <meniscus/field/reach_index.h>
#include <meniscus/points/neighbours.h>
#include <meniscus/pointset/local_fit.h>
#include <meniscus/pointset/point_set_field.h>
#include <meniscus/pointset/point_set_field.kernel.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>

namespace meniscus::pointset {

using field::Interval;

namespace {

constexpr field_kernel::Sum kSumSse2[3] = {field_kernel::sum<0>, field_kernel::sum<1>, field_kernel::sum<2>};

constexpr double kRim = 0.05;        // sum of weights below which the field passes into the far distance
constexpr std::size_t kVoters = 8;   // nearest points of which the one seen most along its normal tells the far sign
constexpr double kClear = 0.9;       // cosine from which on the nearest point's normal needs no second opinion
constexpr std::size_t kMost = 4000;  // domains looked at for a bound
constexpr double kSlack = 1e-9;      // of bounds, against rounding

/// Fades from 0 to 1 with two continuous derivatives.
struct Fade {
  double value = 1, first = 0, second = 0;
};
Fade fade(double weights) {
  const double y = weights / kRim;
  if (y >= 1) return {};
  return {y * y * y * (10 + y * (6 * y - 15)), 30 * y * y * (1 - y) * (1 - y) / kRim,
          60 * y * (1 - y) * (1 - 2 * y) / (kRim * kRim)};
}

/// Value, gradient and Hessian at a point.
struct Jet {
  double f = 0;
  Vec3 g = Vec3::Zero();
  Mat3 h = Mat3::Zero();
};

Jet jet_at(const double* rows, std::size_t stride, std::size_t i, int level) {
  const auto row = [&](std::size_t r) { return rows[r * stride + i]; };
  Jet j;
  j.f = row(0);
  if (level > 0) j.g = Vec3(row(1), row(2), row(3));
  if (level > 1) j.h << row(4), row(5), row(6), row(5), row(7), row(8), row(6), row(8), row(9);
  return j;
}

/// A/W.
Jet quotient(const Jet& a, const Jet& w) {
  Jet s;
  s.f = a.f / w.f;
  s.g = (a.g - s.f * w.g) / w.f;
  s.h = (a.h - s.f * w.h - s.g * w.g.transpose() - w.g * s.g.transpose()) / w.f;
  return s;
}

/// From `far` to `near` as the weights grow.
Jet faded(const Jet& near, const Jet& far, const Jet& w) {
  const Fade b = fade(w.f);
  const Jet d{near.f - far.f, near.g - far.g, near.h - far.h};
  const Vec3 bg = b.first * w.g;
  const Mat3 bh = b.first * w.h + b.second * w.g * w.g.transpose();
  return {far.f + b.value * d.f, far.g + b.value * d.g + d.f * bg,
          far.h + b.value * d.h + bg * d.g.transpose() + d.g * bg.transpose() + d.f * bh};
}

void store(const Jet& j, const field::JetView& out, std::size_t i) {
  using namespace field;
  out.row(kF)[i] = j.f;
  if (has_gradient(out.order))
    for (std::size_t a = 0; a < 3; ++a) out.row(kFx + a)[i] = j.g[static_cast<Eigen::Index>(a)];
  if (has_time(out.order)) out.row(kFt)[i] = 0;
  if (!has_hessian(out.order)) return;
  const double h[6] = {j.h(0, 0), j.h(0, 1), j.h(0, 2), j.h(1, 1), j.h(1, 2), j.h(2, 2)};
  for (std::size_t k = 0; k < 6; ++k) out.row(kFxx + k)[i] = h[k];
  if (has_time(out.order))
    for (std::size_t a = 0; a < 3; ++a) out.row(kFxt + a)[i] = 0;
}

int level_of(field::Order order) { return field::has_hessian(order) ? 2 : field::has_gradient(order) ? 1 : 0; }

}  // namespace

/// Where the domains are: made from positions and reaches, never changed.
struct PointSetField::Index {
  explicit Index(const PointSet& set) : places(positions(set)), domains(set.x, set.y, set.z, grown(set.reach)) {
    const auto order = domains.order();
    for (auto* a : {&x, &y, &z, &inverse2}) a->resize(order.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
      const std::size_t i = order[k];
      x[k] = set.x[i], y[k] = set.y[i], z[k] = set.z[i];
      inverse2[k] = 1 / (set.reach[i] * set.reach[i]);
    }
    for (std::size_t i = 0; i < set.size(); ++i) {
      box.extend(set.position(i));
      widest = std::max(widest, set.reach[i]);
    }
  }

  /// A hair wider than the kernel's own cut, so that rounding in the search never drops what the kernel would count.
  static std::vector<double> grown(std::vector<double> reach) {
    for (double& r : reach) r *= 1 + 1e-12;
    return reach;
  }

  const points::NeighbourSearch& search() const {
    std::call_once(once, [&] { tree.emplace(places); });
    return *tree;
  }

  std::vector<Vec3> places;
  field::ReachIndex domains;
  std::vector<double> x, y, z, inverse2;  // in the order of `domains`
  Box box;                                // of the points
  double widest = 0;                      // reach
  mutable std::once_flag once;
  mutable std::optional<points::NeighbourSearch> tree;  // wanted only far from the surface: made at the first question
};

PointSetField::PointSetField(PointSet set, const PointSetFieldOptions& options) : set_(std::move(set)), options_(options) {
  if (set_.empty()) throw InvalidInput("point-set field: no points");
  refresh();
}

void PointSetField::refresh() { index_ = std::make_shared<const Index>(set_); }

/// The signed distance to the nearest point.
struct PointSetField::Far : Jet {};

/// Inside or outside far from the surface, by the nearest point's normal where that is seen nearly along its length; where
/// it is not, as beyond an edge, by that of the few nearest which is seen best.
double PointSetField::far_sign(const Vec3& p, std::size_t nearest) const {
  if (!index_->box.padded(index_->widest).contains(p)) return 1;
  const auto height = [&](std::size_t i) { return set_.normal(i).dot(p - set_.position(i)); };
  const auto distance = [&](std::size_t i) { return (p - set_.position(i)).stableNorm(); };
  const double first = height(nearest);
  if (std::abs(first) > kClear * distance(nearest)) return first < 0 ? -1 : 1;
  thread_local std::vector<points::Neighbour> found;
  index_->search().nearest(p, kVoters, found);
  double clearest = -1, sign = 1;
  for (const points::Neighbour& n : found) {
    const double h = height(n.index), along = std::abs(h) / distance(n.index);
    if (!(along > clearest)) continue;
    clearest = along;
    sign = h < 0 ? -1 : 1;
  }
  return sign;
}

PointSetField::Far PointSetField::far_at(const Vec3& p) const {
  thread_local std::vector<points::Neighbour> found;
  index_->search().nearest(p, 1, found);
  Far far;
  if (found.empty()) return far;
  const std::size_t nearest = found[0].index;
  const Vec3 d = p - set_.position(nearest);
  const double distance = d.stableNorm(), sign = far_sign(p, nearest);
  far.f = sign * distance;
  if (!(distance > 0)) {
    far.g = set_.normal(nearest);
    return far;
  }
  const Vec3 n = d / distance;
  far.g = sign * n;
  far.h = sign / distance * (Mat3::Identity() - n * n.transpose());
  return far;
}

bool PointSetField::beyond_border(std::size_t nearest, const Vec3& p) const {
  const Vec3 b = set_.border(nearest);
  return b.dot(p - set_.position(nearest)) > b.squaredNorm() && b != Vec3::Zero();
}

/// Calls visit(i, sums, stride, k) for every point x[i]: the kernel's rows of it are at place k of each row; sums is null
/// where no domain can be.
template <class Visit>
void PointSetField::sum(const field::Positions& x, field::Order order, const Visit& visit) const {
  const field_kernel::Domains domains{
      index_->x.data(), index_->y.data(),    index_->z.data(), index_->inverse2.data(), index_->domains.order().data(),
      set_.nx.data(),   set_.ny.data(),      set_.nz.data(),   set_.reach.data(),       set_.coefficients.data(),
      set_.grid,        options_.interpolate};
  const field_kernel::Sum kernel = (field::has_avx2() ? field_kernel::kSumAvx2 : kSumSse2)[level_of(order)];
  field::PositionBatch gathered(field::kBlock);
  std::vector<double> rows(field_kernel::kRows * field::kBlock);
  std::vector<field_kernel::Range> list;
  for (std::size_t begin = 0; begin < x.size; begin += field::kBlock) {
    const field::Positions part = x.part(begin, std::min(field::kBlock, x.size - begin));
    index_->domains.for_groups(
        part, [&](std::span<const field::ReachIndex::Range> ranges, std::span<const std::uint32_t> group) {
          list.clear();
          for (const auto& r : ranges) list.push_back({r.begin, r.end});
          for (std::size_t k = 0; k < group.size(); ++k) gathered.set(k, part[group[k]]);
          const double* const places[3] = {gathered.x.data(), gathered.y.data(), gathered.z.data()};
          if (!list.empty()) kernel(domains, list.data(), list.size(), places, group.size(), rows.data(), field::kBlock);
          for (std::size_t k = 0; k < group.size(); ++k)
            visit(begin + group[k], list.empty() ? nullptr : rows.data(), field::kBlock, k);
        });
  }
}

void PointSetField::do_evaluate(const field::Positions& x, const field::JetView& out) const {
  using namespace field_kernel;
  const int level = level_of(out.order);
  sum(x, out.order, [&](std::size_t i, const double* rows, std::size_t stride, std::size_t k) {
    constexpr double kNothing = 1e-100;  // a sum of weights too small to divide by; the fade has long won
    const bool near = rows != nullptr && rows[kJet * stride + k] > kNothing;
    if (!near || beyond_border(static_cast<std::size_t>(rows[kNearest * stride + k]), x[i]))
      return store(far_at(x[i]), out, i);
    const ::meniscus::pointset::Jet w = jet_at(rows + kJet * stride, stride, k, level);
    const ::meniscus::pointset::Jet s = quotient(jet_at(rows, stride, k, level), w);
    store(w.f < kRim ? faded(s, far_at(x[i]), w) : s, out, i);
  });
}

void PointSetField::covers(const field::Positions& x, std::span<std::uint8_t> out) const {
  using namespace field_kernel;
  sum(x, field::Order::Value, [&](std::size_t i, const double* rows, std::size_t stride, std::size_t k) {
    out[i] = rows != nullptr && rows[kJet * stride + k] > 0 &&
                     !beyond_border(static_cast<std::size_t>(rows[kNearest * stride + k]), x[i])
                 ? 1
                 : 0;
  });
}

/// Bounds on the far distance over a box: its size from the nearest point to the centre; its sign where all points that can
/// have a vote anywhere in the box agree by more than the box is wide.
Interval PointSetField::far_range(const Box& box) const {
  const Vec3 c = box.center();
  const double half = 0.5 * box.diameter() * (1 + kSlack);
  std::vector<points::Neighbour> found;
  index_->search().nearest(c, kVoters, found);
  const double nearest = std::sqrt(found.front().squared_distance), farthest = std::sqrt(found.back().squared_distance);
  const double hi = (nearest + half) * (1 + kSlack), lo = (nearest - half) * (1 - kSlack);
  if (!(lo > 0)) return {-hi, hi};
  const Box room = index_->box.padded(index_->widest);
  if (!box.overlaps(room)) return {lo, hi};
  const bool leaves = !(room.contains(box.min) && room.contains(box.max));
  index_->search().within(c, (farthest + 2 * half) * (1 + kSlack), found);
  bool outside = true, inside = !leaves;
  for (const points::Neighbour& n : found) {
    const double height = set_.normal(n.index).dot(c - set_.position(n.index));
    outside = outside && height > half;
    inside = inside && height < -half;
    if (!outside && !inside) return {-hi, hi};
  }
  return outside ? Interval(lo, hi) : Interval(-hi, -lo);
}

Interval PointSetField::range(const Box& box) const {
  if (box.empty() || !box.finite()) return Interval::everything();
  std::vector<field::ReachIndex::Range> ranges;
  if (!index_->domains.overlapping(box, kMost, ranges)) return Interval::everything();

  const double infinity = std::numeric_limits<double>::infinity();
  const auto order = index_->domains.order();
  const Vec3 c = box.center(), half = 0.5 * box.size();
  double lo = infinity, hi = -infinity, weights = 0;
  bool border = false;
  for (const auto& range : ranges)
    for (std::uint32_t k = range.begin; k < range.end; ++k) {
      const std::size_t i = order[k];
      const Vec3 p = set_.position(i), n = set_.normal(i);
      const double near2 = (p - p.cwiseMax(box.min).cwiseMin(box.max)).squaredNorm();
      const double reach = set_.reach[i];
      if (near2 > reach * reach * (1 + kSlack)) continue;
      const double far2 = (p - box.min).cwiseAbs().cwiseMax((box.max - p).cwiseAbs()).squaredNorm();
      const double m = std::max(0.0, 1 - far2 / (reach * reach) - kSlack);
      weights += m * m * m * m;
      border = border || set_.border(i) != Vec3::Zero();
      // The tangent plane over the part of the box in the domain, and the hull of what the spline adds to it.
      const double height = n.dot(c - p), swing = n.cwiseAbs().dot(half);
      const auto [least, most] = residual_bounds(set_, i);
      lo = std::min(lo, std::max(height - swing, -reach) + least - kSlack * reach);
      hi = std::max(hi, std::min(height + swing, reach) + most + kSlack * reach);
    }
  if (lo > hi) return far_range(box);
  if (!border && weights > kRim * (1 + kSlack)) return {lo, hi};
  return hull({lo, hi}, far_range(box));
}

Box PointSetField::bounds_below(double level) const { return index_->box.padded(std::max(level, index_->widest)); }

}  // namespace meniscus::pointset
