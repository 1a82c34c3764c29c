#include <meniscus/base/error.h>
#include <meniscus/field/blobs.h>
#include <meniscus/field/blobs.kernel.h>
#include <meniscus/field/cpu.h>
#include <meniscus/field/reach_index.h>
#include <meniscus/field/segment.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

namespace meniscus::field {
namespace {

const BlobKernels kBlobsSse2 = kernel::table<packet::Sse2>();

const BlobKernels& kernels() { return has_avx512() ? kBlobsAvx512 : has_avx2() ? kBlobsAvx2 : kBlobsSse2; }

constexpr std::size_t kNarrow = 32;  // points at once whose candidates are narrowed
constexpr std::size_t kShared = 4;   // candidates per point up to which all points of a block share them
constexpr std::size_t kMany = 48;    // candidates from which on that pays

const SlotInfo kPointSlots[] = {{"center.x", Quantity::Coordinate},
                                {"center.y", Quantity::Coordinate},
                                {"center.z", Quantity::Coordinate},
                                {"radius", Quantity::Length, 0},
                                {"weight", Quantity::Weight}};
const SlotInfo kSegmentSlots[] = {{"a.x", Quantity::Coordinate},   {"a.y", Quantity::Coordinate},
                                  {"a.z", Quantity::Coordinate},   {"b.x", Quantity::Coordinate},
                                  {"b.y", Quantity::Coordinate},   {"b.z", Quantity::Coordinate},
                                  {"radius", Quantity::Length, 0}, {"weight", Quantity::Weight}};
const SlotInfo kBiasSlots[] = {{"bias", Quantity::Weight}};

/// A blob's term at one point, templated for F_q.
template <class Kernel, class X, class Q>
Q term_of(bool segment, const X* x, const Q* q) {
  const int n = segment ? 6 : 3;
  Q u;
  if (segment) {
    u = shapes::segment_distance_squared(x, q) / (q[n] * q[n]);
  } else {
    const auto d = shapes::minus(x, q);
    u = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) / (q[n] * q[n]);
  }
  double f, f1, f2;
  Kernel::at(u.v, f, f1, f2);
  return q[n + 1] * jet::chain(u, f, f1, f2);
}

class BlobSum final : public Field {
 public:
  BlobSum(BlobKernel kernel, bool segment, const Number& bias, Slots slots)
      : kernel_(kernel), segment_(segment), n_(segment ? 6 : 3), bias_(kBiasSlots, 1), slots_(std::move(slots)) {
    bias_.bind(0, 0, bias, "bias");
    merge_parameters();
    check();
    refresh();
  }

  std::unique_ptr<Field> clone() const override { return std::make_unique<BlobSum>(*this); }
  bool moving() const override { return bias_.moving() || slots_.moving(); }

  Box bounds_below(double level) const override {
    if (bias_.value(0, 0) > level) return index_.bounds();
    return Box::everywhere();
  }

  Interval range(const Box& box) const override;

 protected:
  void do_evaluate(const Positions& x, const JetView& out) const override;
  void do_material_velocity(const Positions& x, const VelocityView& out) const override;
  void do_parameter_rows(const Positions& x, SparseRows& rows) const override;

  void do_set_parameters(std::span<const double> values, std::span<const double> rates) override {
    std::vector<double> v, r;
    for (const std::uint32_t i : bias_map_) v.push_back(values[i]), r.push_back(rates.empty() ? 0 : rates[i]);
    bias_.set_parameters(v, r);
    v.clear(), r.clear();
    for (const std::uint32_t i : item_map_) v.push_back(values[i]), r.push_back(rates.empty() ? 0 : rates[i]);
    slots_.set_parameters(v, r);
    refresh();
  }

  void do_set_time(double t) override {
    const bool bias = bias_.set_time(t), items = slots_.set_time(t);
    if (bias || items) refresh();
  }

 private:
  double reach_factor() const {
    return std::sqrt(kernel_ == BlobKernel::Gaussian ? shapes::Gaussian::kReach2 : shapes::Compact::kReach2);
  }

  void merge_parameters();
  void check() const;
  void refresh();
  BlobArrays arrays() const;
  /// The squared reach in radii that narrowing grants, a hair beyond the kernel's.
  double narrow_reach2() const { return reach_factor() * reach_factor() * (1 + 1e-9); }
  std::vector<std::uint32_t> reaching(std::span<const ReachIndex::Range> ranges, const PointBox& box) const;
  void sum(std::span<const ReachIndex::Range> ranges, const Positions& x, const JetView& out) const;
  void sum_in_groups(const Positions& x, const JetView& out) const;
  Interval item_range(std::uint32_t k, const Box& box) const;

  BlobKernel kernel_;
  bool segment_;
  std::size_t n_;  // coordinates per blob
  Slots bias_;
  Slots slots_;
  std::vector<std::uint32_t> bias_map_, item_map_;  // from the parameters of bias_ and slots_ to ours
  ReachIndex index_;
  std::vector<std::vector<double>> q_, rate_;  // [number][position in the index's order]
  double weight_sum_positive_ = 0, weight_sum_negative_ = 0;
};

void BlobSum::merge_parameters() {
  parameters_ = bias_.parameters();
  for (std::uint32_t i = 0; i < parameters_.size(); ++i) bias_map_.push_back(i);
  for (const Parameter& p : slots_.parameters()) {
    std::uint32_t at = static_cast<std::uint32_t>(parameters_.size());
    if (p.shared && !bias_map_.empty() && parameters_[0].shared && parameters_[0].name == p.name) at = 0;
    if (at == parameters_.size()) parameters_.push_back(p);
    item_map_.push_back(at);
  }
}

void BlobSum::check() const {
  if (!std::isfinite(bias_.value(0, 0))) throw InvalidInput("blobs: bias is not finite");
  for (std::size_t i = 0; i < slots_.items(); ++i) {
    const std::string item = "blobs: items[" + std::to_string(i) + "]";
    for (std::size_t s = 0; s < slots_.slots(); ++s)
      if (!std::isfinite(slots_.value(i, s))) throw InvalidInput(item + " holds a number that is not finite");
    if (!(slots_.value(i, n_) > 0)) throw InvalidInput(item + ": radius must be above zero");
  }
}

void BlobSum::refresh() {
  const std::size_t items = slots_.items();
  // Spheres that hold what each blob reaches.
  std::vector<double> x(items), y(items), z(items), reach(items);
  weight_sum_positive_ = weight_sum_negative_ = 0;
  for (std::size_t i = 0; i < items; ++i) {
    const double w = slots_.value(i, n_ + 1);
    const double s = segment_ ? 0.5 : 0;
    const Vec3 a(slots_.value(i, 0), slots_.value(i, 1), slots_.value(i, 2));
    const Vec3 b = segment_ ? Vec3(slots_.value(i, 3), slots_.value(i, 4), slots_.value(i, 5)) : a;
    const Vec3 middle = (1 - s) * a + s * b;
    x[i] = middle.x(), y[i] = middle.y(), z[i] = middle.z();
    const bool silent = w == 0 && slots_.rate(i, n_ + 1) == 0;
    // A hair wider than the kernel's own cut, so that rounding in the search never drops what the kernel would count.
    reach[i] = silent ? 0 : (s * (b - a).norm() + slots_.value(i, n_) * reach_factor()) * (1 + 1e-12);
    (w > 0 ? weight_sum_positive_ : weight_sum_negative_) += w;
  }
  index_ = ReachIndex(x, y, z, reach);

  const auto order = index_.order();
  q_.assign(n_ + 2, std::vector<double>(order.size()));
  rate_.assign(slots_.moving() ? n_ + 2 : 0, std::vector<double>(order.size()));
  for (std::size_t k = 0; k < order.size(); ++k) {
    for (std::size_t s = 0; s < n_ + 2; ++s) q_[s][k] = slots_.value(order[k], s);
    const double r = q_[n_][k];
    q_[n_][k] = 1 / (r * r);
    if (rate_.empty()) continue;
    for (std::size_t s = 0; s < n_ + 2; ++s) rate_[s][k] = slots_.rate(order[k], s);
    rate_[n_][k] *= -2 / (r * r * r);
  }
}

BlobArrays BlobSum::arrays() const {
  BlobArrays b{};
  b.moving = moving();
  static const std::vector<double> none;
  for (std::size_t s = 0; s < n_ + 2; ++s) {
    b.q[s] = q_[s].data();
    b.rate[s] = rate_.empty() ? q_[s].data() : rate_[s].data();
  }
  return b;
}

/// The point blobs of `ranges` that may reach the box of x. What is left out adds nothing anywhere, so sums keep their bits.
std::vector<std::uint32_t> BlobSum::reaching(std::span<const ReachIndex::Range> ranges, const PointBox& box) const {
  const double reach2 = narrow_reach2();
  const auto outside = [](double low, double c, double high) { return std::max(0.0, std::max(low - c, c - high)); };
  std::vector<std::uint32_t> found;
  for (const auto& range : ranges)
    for (std::uint32_t i = range.begin; i < range.end; ++i) {
      double d2 = 0;
      for (std::size_t a = 0; a < 3; ++a) {
        const double away = outside(box.low[a], q_[a][i], box.high[a]);
        d2 += away * away;
      }
      if (d2 * q_[3][i] <= reach2) found.push_back(i);
    }
  return found;
}

void BlobSum::sum(std::span<const ReachIndex::Range> ranges, const Positions& x, const JetView& out) const {
  std::vector<BlobRange> all;
  std::size_t candidates = 0;
  for (const auto& r : ranges) {
    all.push_back({r.begin, r.end});
    candidates += r.end - r.begin;
  }
  const double bias[2] = {bias_.value(0, 0), bias_.rate(0, 0)};
  // Rates exist only for items that move; a bias alone may move too.
  BlobArrays b = arrays();
  std::vector<double> zeros;
  if (b.moving && rate_.empty()) {
    zeros.assign(index_.order().size(), 0.0);
    for (std::size_t s = 0; s < n_ + 2; ++s) b.rate[s] = zeros.data();
  }
  const SumBlobs sum_blobs = kernels().sum[segment_ ? 1 : 0][kernel_ == BlobKernel::Compact ? 1 : 0];
  if (segment_ || candidates < kMany) {
    sum_blobs(b, all.data(), all.size(), bias, x, out);
    return;
  }

  // Those that may reach any of the points side by side, and of these, for every few points, those that may reach them.
  const std::vector<std::uint32_t> near = reaching(ranges, PointBox(x));
  std::vector<double> numbers;
  numbers.reserve(2 * (n_ + 2) * near.size());
  const auto side_by_side = [&](const double*& values) {
    const double* from = values;
    values = numbers.data() + numbers.size();
    for (const std::uint32_t i : near) numbers.push_back(from[i]);
  };
  for (std::size_t s = 0; s < n_ + 2; ++s) {
    side_by_side(b.q[s]);
    if (b.moving) side_by_side(b.rate[s]);
  }
  std::vector<BlobRange> list(near.size());
  for (std::size_t begin = 0; begin < x.size; begin += kNarrow) {
    const std::size_t size = std::min(kNarrow, x.size - begin);
    const Positions part = x.part(begin, size);
    const std::size_t runs = kernels().narrow(b, near.size(), PointBox(part), narrow_reach2(), list.data());
    sum_blobs(b, list.data(), runs, bias, part, out.part(begin, size));
  }
}

void BlobSum::do_evaluate(const Positions& x, const JetView& out) const {
  std::vector<ReachIndex::Range> ranges;
  for (std::size_t begin = 0; begin < x.size; begin += kBlock) {
    const std::size_t size = std::min(kBlock, x.size - begin);
    const Positions part = x.part(begin, size);
    const PointBox box(part);
    ranges.clear();
    // Points that lie together share one list; others are grouped by where they are.
    if (!segment_ && index_.overlapping({Vec3(box.low), Vec3(box.high)}, kShared * size, ranges))
      sum(ranges, part, out.part(begin, size));
    else
      sum_in_groups(part, out.part(begin, size));
  }
}

void BlobSum::sum_in_groups(const Positions& x, const JetView& out) const {
  PositionBatch gathered(x.size);
  JetBatch jets(x.size, out.order);
  index_.for_groups(x, [&](std::span<const ReachIndex::Range> ranges, std::span<const std::uint32_t> group) {
    for (std::size_t k = 0; k < group.size(); ++k) gathered.set(k, x[group[k]]);
    const JetView view = jets.view().part(0, group.size());
    sum(ranges, gathered.view().part(0, group.size()), view);
    for (std::size_t r = 0; r < row_count(out.order); ++r)
      for (std::size_t k = 0; k < group.size(); ++k) out.row(r)[group[k]] = view.row(r)[k];
  });
}

void BlobSum::do_material_velocity(const Positions& x, const VelocityView& out) const {
  double q[BlobArrays::kMost] = {}, rate[BlobArrays::kMost] = {};
  index_.for_groups(x, [&](std::span<const ReachIndex::Range> ranges, std::span<const std::uint32_t> group) {
    for (const std::uint32_t p : group) {
      // [SS11 §5]: the mean of the blobs' velocities, each weighted by the factor of d in its gradient.
      const Vec3 point = x[p];
      Vec3 sum = Vec3::Zero();
      double weights = 0;
      for (const auto& range : ranges)
        for (std::uint32_t k = range.begin; k < range.end && !rate_.empty(); ++k) {
          for (std::size_t s = 0; s < n_; ++s) q[s] = q_[s][k], rate[s] = rate_[s][k];
          const Vec3 c(q[0], q[1], q[2]);
          const double d2 = segment_ ? shapes::segment_distance_squared(point.data(), q) : (point - c).squaredNorm();
          const double u = d2 * q_[n_][k];
          if (!(u < reach_factor() * reach_factor())) continue;
          double f, f1, f2;
          kernel_ == BlobKernel::Gaussian ? shapes::Gaussian::at(u, f, f1, f2) : shapes::Compact::at(u, f, f1, f2);
          const double a = std::abs(q_[n_ + 1][k] * f1 * q_[n_][k]);
          sum += a * (segment_ ? segment_velocity(q, rate, point) : Vec3(rate[0], rate[1], rate[2]));
          weights += a;
        }
      if (weights > 0) sum /= weights;
      out.x[p] = sum.x();
      out.y[p] = sum.y();
      out.z[p] = sum.z();
    }
  });
}

void BlobSum::do_parameter_rows(const Positions& x, SparseRows& rows) const {
  using J = jet::Jet1<double, BlobArrays::kMost>;
  const auto order = index_.order();
  std::vector<ReachIndex::Range> ranges;
  const double limit = kernel_ == BlobKernel::Gaussian ? shapes::Gaussian::kReach2 : shapes::Compact::kReach2;
  for (std::size_t p = 0; p < x.size; ++p) {
    const Vec3 point = x[p];
    if (!bias_map_.empty()) {
      rows.index.push_back(bias_map_[0]);
      rows.value.push_back(1);
    }
    ranges.clear();
    if (point.allFinite() && index_.bounds().contains(point)) index_.candidates(index_.cell(point), ranges);
    for (const auto& range : ranges)
      for (std::uint32_t k = range.begin; k < range.end; ++k) {
        double plain[BlobArrays::kMost];
        for (std::size_t s = 0; s < n_ + 2; ++s) plain[s] = slots_.value(order[k], s);
        const double d2 = segment_ ? shapes::segment_distance_squared(point.data(), plain)
                                   : (point - Vec3(plain[0], plain[1], plain[2])).squaredNorm();
        if (!(d2 * q_[n_][k] < limit)) continue;
        J q[BlobArrays::kMost];
        for (std::size_t s = 0; s < n_ + 2; ++s) q[s] = jet::variable<J>(plain[s], static_cast<int>(s));
        const J f = kernel_ == BlobKernel::Gaussian ? term_of<shapes::Gaussian>(segment_, point.data(), q)
                                                    : term_of<shapes::Compact>(segment_, point.data(), q);
        for (std::size_t s = 0; s < n_ + 2; ++s)
          if (const auto unknown = slots_.unknown(order[k], s)) {
            rows.index.push_back(item_map_[*unknown]);
            rows.value.push_back(-f.d[s]);
          }
      }
    rows.end_row();
  }
}

Interval BlobSum::item_range(std::uint32_t k, const Box& box) const {
  double near2, far2;
  if (segment_) {
    double q[6];
    for (std::size_t s = 0; s < 6; ++s) q[s] = q_[s][k];
    const Vec3 c = box.center();
    const double d = std::sqrt(shapes::segment_distance_squared(c.data(), q)), h = 0.5 * box.diameter();
    near2 = d > h ? (d - h) * (d - h) : 0;
    far2 = (d + h) * (d + h);
  } else {
    const Vec3 c(q_[0][k], q_[1][k], q_[2][k]);
    near2 = (c - c.cwiseMax(box.min).cwiseMin(box.max)).squaredNorm();
    far2 = (c - box.min).cwiseAbs().cwiseMax((c - box.max).cwiseAbs()).squaredNorm();
  }
  const auto kernel = [&](double d2) {
    const double u = d2 * q_[n_][k];
    if (kernel_ == BlobKernel::Gaussian) return std::exp(-u);
    const double m = std::max(0.0, 1 - u);
    return m * m * m;
  };
  return Interval(kernel(far2), kernel(near2)) * Interval(q_[n_ + 1][k]);
}

Interval BlobSum::range(const Box& box) const {
  const double bias = bias_.value(0, 0);
  if (box.empty()) return {bias, bias};
  std::vector<ReachIndex::Range> ranges;
  constexpr std::size_t kMost = 2000;  // beyond that the sum of all weights is bound enough
  Interval sum(0);
  if (box.finite() && index_.overlapping(box, kMost, ranges)) {
    for (const auto& range : ranges)
      for (std::uint32_t k = range.begin; k < range.end; ++k) sum = sum + item_range(k, box);
  } else {
    sum = {weight_sum_negative_, weight_sum_positive_};
  }
  // Rounding of the sums, and the Gaussians' tails beyond their cut.
  const double slack = 1e-12 * (std::abs(bias) + std::abs(sum.lo) + std::abs(sum.hi));
  return {bias - sum.hi - slack, bias - sum.lo + slack};
}

std::string item_path(std::size_t i, std::string_view slot) {
  return "items[" + std::to_string(i) + "]." + std::string(slot);
}

}  // namespace

std::unique_ptr<Field> blobs(BlobKernel kernel, const Number& bias, std::span<const Blob> items) {
  Slots slots(kPointSlots, items.size());
  for (std::size_t i = 0; i < items.size(); ++i) {
    const Number numbers[] = {items[i].center[0], items[i].center[1], items[i].center[2], items[i].radius, items[i].weight};
    for (std::size_t s = 0; s < std::size(numbers); ++s) slots.bind(i, s, numbers[s], item_path(i, kPointSlots[s].name));
  }
  return std::make_unique<BlobSum>(kernel, false, bias, std::move(slots));
}

std::unique_ptr<Field> segments(BlobKernel kernel, const Number& bias, std::span<const SegmentBlob> items) {
  Slots slots(kSegmentSlots, items.size());
  for (std::size_t i = 0; i < items.size(); ++i) {
    const SegmentBlob& b = items[i];
    const Number numbers[] = {b.a[0], b.a[1], b.a[2], b.b[0], b.b[1], b.b[2], b.radius, b.weight};
    for (std::size_t s = 0; s < std::size(numbers); ++s) slots.bind(i, s, numbers[s], item_path(i, kSegmentSlots[s].name));
  }
  return std::make_unique<BlobSum>(kernel, true, bias, std::move(slots));
}

std::unique_ptr<Field> particles(std::span<const Vec3> positions, std::span<const double> radii,
                                 std::span<const Vec3> velocities, std::size_t* dropped) {
  if (radii.size() != 1 && radii.size() != positions.size())
    throw InvalidInput("particles: one radius for all, or one per particle");
  if (!velocities.empty() && velocities.size() != positions.size())
    throw InvalidInput("particles: one velocity per particle, or none");
  std::vector<std::size_t> sound;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const double r = radii[radii.size() == 1 ? 0 : i];
    if (std::isfinite(r) && r <= 0) throw InvalidInput("particles: radii must be above zero");
    if (positions[i].allFinite() && std::isfinite(r) && (velocities.empty() || velocities[i].allFinite()))
      sound.push_back(i);
  }
  if (dropped != nullptr) *dropped = positions.size() - sound.size();

  Slots slots(kPointSlots, sound.size());
  for (std::size_t k = 0; k < sound.size(); ++k) {
    const std::size_t i = sound[k];
    for (int a = 0; a < 3; ++a)
      slots.fix(k, static_cast<std::size_t>(a), positions[i][a], velocities.empty() ? 0 : velocities[i][a]);
    slots.fix(k, 3, 2 * radii[radii.size() == 1 ? 0 : i], 0);
    slots.fix(k, 4, 1, 0);
  }
  return std::make_unique<BlobSum>(BlobKernel::Compact, false, Number::frozen(27.0 / 64.0), std::move(slots));
}

}  // namespace meniscus::field
