#include <meniscus/base/error.h>
#include <meniscus/field/children.h>
#include <meniscus/field/combine.h>
#include <meniscus/field/combine.kernel.h>
#include <meniscus/field/cpu.h>

#include <algorithm>
#include <cmath>

namespace meniscus::field {
namespace {

constexpr std::size_t kRows = row_count(Order::HessianTime);
constexpr std::size_t kPruneInputs = 3, kPrunePoints = 32;  // below, asking for bounds costs more than it saves

enum class Set { Union, Intersection, Difference };

const SlotInfo kBlendSlots[] = {{"k", Quantity::Length, 0}};

void negate(const JetView& a) {
  for (std::size_t r = 0; r < row_count(a.order); ++r)
    for (std::size_t i = 0; i < a.size; ++i) a.row(r)[i] = -a.row(r)[i];
}

/// Every set operation is one fold: s · smooth_least over the inputs sᵢFᵢ, with signs +1 or −1 and a width k >= 0.
class Combination final : public Field {
 public:
  Combination(Set set, Inputs inputs, const Number* k)
      : set_(set), children_(std::move(inputs), "inputs", parameters_), k_(kBlendSlots, 1) {
    k_.bind(0, 0, k != nullptr ? *k : Number::frozen(0), "k");
    if (k != nullptr && !(k_.value(0, 0) > 0 && std::isfinite(k_.value(0, 0))))
      throw InvalidInput("blend: k must be above zero");
    k_map_ = merge_parameters(k_.parameters(), "", parameters_);
  }

  std::unique_ptr<Field> clone() const override { return std::make_unique<Combination>(*this); }
  bool moving() const override { return children_.moving() || k_.moving(); }
  Interval range(const Box& box) const override;
  Box bounds_below(double level) const override;

 protected:
  void do_evaluate(const Positions& x, const JetView& out) const override;
  void do_material_velocity(const Positions& x, const VelocityView& out) const override;
  void do_parameter_rows(const Positions& x, SparseRows& rows) const override;
  void do_set_parameters(std::span<const double> values, std::span<const double> rates) override {
    children_.set_parameters(values, rates);
    k_.set_parameters(gather(values, k_map_), gather(rates, k_map_));
  }
  void do_set_time(double t) override {
    children_.set_time(t);
    k_.set_time(t);
  }

 private:
  double sign(std::size_t i) const {
    if (set_ == Set::Union) return 1;
    return set_ == Set::Intersection || i == 0 ? -1 : 1;
  }
  double sign_out() const { return set_ == Set::Union ? 1 : -1; }
  double k() const { return k_.value(0, 0); }
  /// How far blends can lower the least of all inputs.
  double bulge() const { return k() * static_cast<double>(children_.size() - 1) / 6; }

  std::vector<std::size_t> deciding(const Positions& x) const;
  void evaluate_block(const Positions& x, const JetView& out) const;
  /// ∂F/∂(input i) and ∂F/∂k at every point: weights[i][p], the last row for k.
  std::vector<std::vector<double>> weights(const Positions& x) const;

  Set set_;
  Children children_;
  Slots k_;
  std::vector<std::uint32_t> k_map_;
};

/// The inputs that can matter somewhere in the box of the points. Leaving out the others changes no bit.
std::vector<std::size_t> Combination::deciding(const Positions& x) const {
  std::vector<std::size_t> all(children_.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
  if (all.size() < kPruneInputs || x.size < kPrunePoints) return all;

  Box box;
  for (std::size_t p = 0; p < x.size; ++p)
    if (x[p].allFinite()) box.extend(x[p]);
  if (box.empty()) return all;
  std::vector<Interval> ranges;
  double least_high = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < all.size(); ++i) {
    ranges.push_back(sign(i) > 0 ? children_[i].range(box) : -children_[i].range(box));
    least_high = std::min(least_high, ranges.back().hi);
  }
  const double limit = least_high + k() + bulge();
  std::erase_if(all, [&](std::size_t i) { return ranges[i].lo > limit; });
  return all;
}

void Combination::evaluate_block(const Positions& x, const JetView& out) const {
  const auto inputs = deciding(x);
  children_[inputs[0]].evaluate(x, out);
  if (sign(inputs[0]) < 0) negate(out);
  double buffer[kRows * kBlock];
  const JetView other{buffer, kBlock, x.size, out.order};
  for (std::size_t n = 1; n < inputs.size(); ++n) {
    children_[inputs[n]].evaluate(x, other);
    static const Fold fold = has_avx2() ? kFoldAvx2 : kernel::fold<packet::Sse2>;
    fold(out, other, sign(inputs[n]), k(), k_.rate(0, 0));
  }
  if (sign_out() < 0) negate(out);
}

void Combination::do_evaluate(const Positions& x, const JetView& out) const {
  for (std::size_t b = 0; b < x.size; b += kBlock) {
    const std::size_t n = std::min(kBlock, x.size - b);
    evaluate_block(x.part(b, n), out.part(b, n));
  }
}

std::vector<std::vector<double>> Combination::weights(const Positions& x) const {
  using J = jet::Jet1<double, 3>;
  const std::size_t n = children_.size();
  std::vector<std::vector<double>> w(n + 1, std::vector<double>(x.size, 0.0));
  std::vector<double> total(x.size), value(x.size);
  children_[0].evaluate(x, {total.data(), x.size, x.size, Order::Value});
  for (std::size_t p = 0; p < x.size; ++p) {
    total[p] *= sign(0);
    w[0][p] = 1;
  }
  for (std::size_t i = 1; i < n; ++i) {
    children_[i].evaluate(x, {value.data(), x.size, x.size, Order::Value});
    for (std::size_t p = 0; p < x.size; ++p) {
      const J a = jet::variable<J>(total[p], 0), b = jet::variable<J>(sign(i) * value[p], 1);
      const J f = k() > 0 ? kernel::smooth_least(a, b, jet::variable<J>(k(), 2)) : jet::least(a, b);
      for (std::size_t j = 0; j < i; ++j) w[j][p] *= f.d[0];
      w[i][p] = f.d[1];
      w[n][p] = w[n][p] * f.d[0] + f.d[2];
      total[p] = f.v;
    }
  }
  return w;
}

void Combination::do_material_velocity(const Positions& x, const VelocityView& out) const {
  // The inputs' weights are never negative and sum to one: the deciding branch alone, or a mean across a blend.
  const auto w = weights(x);
  std::vector<double> v(3 * x.size);
  const VelocityView view{v.data(), v.data() + x.size, v.data() + 2 * x.size};
  Field::do_material_velocity(x, out);
  for (std::size_t i = 0; i < children_.size(); ++i) {
    children_[i].material_velocity(x, view);
    for (std::size_t p = 0; p < x.size; ++p) {
      if (w[i][p] == 0) continue;
      out.x[p] += w[i][p] * view.x[p];
      out.y[p] += w[i][p] * view.y[p];
      out.z[p] += w[i][p] * view.z[p];
    }
  }
}

void Combination::do_parameter_rows(const Positions& x, SparseRows& rows) const {
  const auto w = weights(x);
  std::vector<SparseRows> inner(children_.size());
  for (std::size_t i = 0; i < children_.size(); ++i) children_[i].parameter_rows(x, inner[i]);
  for (std::size_t p = 0; p < x.size; ++p) {
    for (std::size_t i = 0; i < children_.size(); ++i)
      children_.append_row(i, inner[i], p, sign_out() * sign(i) * w[i][p], rows);
    if (!k_map_.empty()) {
      rows.index.push_back(k_map_[0]);
      rows.value.push_back(sign_out() * w.back()[p]);
    }
    rows.end_row();
  }
}

Interval Combination::range(const Box& box) const {
  Interval r(std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < children_.size(); ++i) {
    const Interval c = children_[i].range(box);
    r = min(r, sign(i) > 0 ? c : -c);
  }
  r.lo -= bulge() * (1 + 1e-12);
  return sign_out() > 0 ? r : -r;
}

Box Combination::bounds_below(double level) const {
  if (set_ == Set::Difference) return children_[0].bounds_below(level);
  Box b = children_[0].bounds_below(set_ == Set::Union ? level + bulge() : level);
  for (std::size_t i = 1; i < children_.size(); ++i) {
    if (set_ == Set::Union)
      b.extend(children_[i].bounds_below(level + bulge()));
    else
      b = b.intersection(children_[i].bounds_below(level));
  }
  return b;
}

const SlotInfo kDistanceSlots[] = {{"distance", Quantity::Length}};
const SlotInfo kThicknessSlots[] = {{"thickness", Quantity::Length, 0}};

/// F − distance, or |F| − thickness/2.
class Layer final : public Field {
 public:
  Layer(std::unique_ptr<Field> input, bool shell, const Number& width)
      : shell_(shell),
        children_(single(std::move(input)), "input", parameters_),
        width_(shell ? std::span<const SlotInfo>(kThicknessSlots) : std::span<const SlotInfo>(kDistanceSlots), 1) {
    width_.bind(0, 0, width, shell ? "thickness" : "distance");
    const double w = width_.value(0, 0);
    if (!std::isfinite(w)) throw InvalidInput(shell ? "shell: thickness is not finite" : "offset: distance is not finite");
    if (shell && w <= 0) throw InvalidInput("shell: thickness must be above zero");
    map_ = merge_parameters(width_.parameters(), "", parameters_);
  }

  std::unique_ptr<Field> clone() const override { return std::make_unique<Layer>(*this); }
  bool moving() const override { return children_.moving() || width_.moving(); }

  Interval range(const Box& box) const override {
    const Interval r = children_[0].range(box);
    return (shell_ ? abs(r) : r) - Interval(lift());
  }
  Box bounds_below(double level) const override { return children_[0].bounds_below(level + lift()); }

 protected:
  void do_evaluate(const Positions& x, const JetView& out) const override {
    children_[0].evaluate(x, out);
    for (std::size_t i = 0; i < x.size; ++i) {
      if (shell_ && out.row(kF)[i] < 0)
        for (std::size_t r = 0; r < row_count(out.order); ++r) out.row(r)[i] = -out.row(r)[i];
      out.row(kF)[i] -= lift();
      if (has_time(out.order)) out.row(kFt)[i] -= lift_rate();
    }
  }
  void do_material_velocity(const Positions& x, const VelocityView& out) const override {
    children_[0].material_velocity(x, out);
  }
  void do_parameter_rows(const Positions& x, SparseRows& rows) const override {
    std::vector<double> f(x.size);
    children_[0].evaluate(x, {f.data(), x.size, x.size, Order::Value});
    SparseRows inner;
    children_[0].parameter_rows(x, inner);
    for (std::size_t p = 0; p < x.size; ++p) {
      children_.append_row(0, inner, p, shell_ && f[p] < 0 ? -1 : 1, rows);
      if (!map_.empty()) {
        rows.index.push_back(map_[0]);
        rows.value.push_back(shell_ ? -0.5 : -1);
      }
      rows.end_row();
    }
  }
  void do_set_parameters(std::span<const double> values, std::span<const double> rates) override {
    children_.set_parameters(values, rates);
    width_.set_parameters(gather(values, map_), gather(rates, map_));
  }
  void do_set_time(double t) override {
    children_.set_time(t);
    width_.set_time(t);
  }

 private:
  static Inputs single(std::unique_ptr<Field> f) {
    Inputs v;
    v.push_back(std::move(f));
    return v;
  }
  double lift() const { return (shell_ ? 0.5 : 1) * width_.value(0, 0); }
  double lift_rate() const { return (shell_ ? 0.5 : 1) * width_.rate(0, 0); }

  bool shell_;
  Children children_;
  Slots width_;
  std::vector<std::uint32_t> map_;
};

}  // namespace

std::unique_ptr<Field> set_union(Inputs inputs) {
  return std::make_unique<Combination>(Set::Union, std::move(inputs), nullptr);
}
std::unique_ptr<Field> set_intersection(Inputs inputs) {
  return std::make_unique<Combination>(Set::Intersection, std::move(inputs), nullptr);
}
std::unique_ptr<Field> set_difference(Inputs inputs) {
  return std::make_unique<Combination>(Set::Difference, std::move(inputs), nullptr);
}
std::unique_ptr<Field> blend(Inputs inputs, const Number& k) {
  return std::make_unique<Combination>(Set::Union, std::move(inputs), &k);
}
std::unique_ptr<Field> offset(std::unique_ptr<Field> input, const Number& distance) {
  return std::make_unique<Layer>(std::move(input), false, distance);
}
std::unique_ptr<Field> shell(std::unique_ptr<Field> input, const Number& thickness) {
  return std::make_unique<Layer>(std::move(input), true, thickness);
}

}  // namespace meniscus::field
