#include <meniscus/base/error.h>
#include <meniscus/field/children.h>
#include <meniscus/field/jet.h>
#include <meniscus/field/transform.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace meniscus::field {
namespace {

const SlotInfo kSlots[] = {{"translate.x", Quantity::Coordinate}, {"translate.y", Quantity::Coordinate},
                           {"translate.z", Quantity::Coordinate}, {"rotate.x", Quantity::Angle},
                           {"rotate.y", Quantity::Angle},         {"rotate.z", Quantity::Angle},
                           {"scale", Quantity::Ratio, 0}};
constexpr std::size_t kNumbers = 7;
constexpr double kDegree = 3.14159265358979323846 / 180;

/// R = Rz Ry Rx, row-major, from angles in degrees.
template <class S>
std::array<S, 9> rotation(const S* degrees) {
  using std::cos;
  using std::sin;
  S c[3], s[3];
  for (int a = 0; a < 3; ++a) {
    const S angle = degrees[a] * kDegree;
    c[a] = cos(angle);
    s[a] = sin(angle);
  }
  return {c[2] * c[1],
          c[2] * s[1] * s[0] - s[2] * c[0],
          c[2] * s[1] * c[0] + s[2] * s[0],
          s[2] * c[1],
          s[2] * s[1] * s[0] + c[2] * c[0],
          s[2] * s[1] * c[0] - c[2] * s[0],
          -s[1],
          c[1] * s[0],
          c[1] * c[0]};
}

/// Local point u = Rᵀ(x − translate)/scale.
template <class S>
std::array<S, 3> to_local(const double* x, const S* q) {
  const auto r = rotation(q + 3);
  const S d[3] = {x[0] - q[0], x[1] - q[1], x[2] - q[2]};
  std::array<S, 3> u;
  for (std::size_t a = 0; a < 3; ++a) u[a] = (r[a] * d[0] + r[3 + a] * d[1] + r[6 + a] * d[2]) / q[6];
  return u;
}

class Transform final : public Field {
 public:
  Transform(std::vector<std::unique_ptr<Field>> input, std::span<const Number> numbers)
      : children_(std::move(input), "input", parameters_), slots_(kSlots, 1) {
    for (std::size_t s = 0; s < kNumbers; ++s) slots_.bind(0, s, numbers[s], std::string(kSlots[s].name));
    for (std::size_t s = 0; s < kNumbers; ++s)
      if (!std::isfinite(slots_.value(0, s))) throw InvalidInput("transform: a number is not finite");
    if (!(slots_.value(0, 6) > 0)) throw InvalidInput("transform: scale must be above zero");
    map_ = merge_parameters(slots_.parameters(), "", parameters_);
    refresh();
  }

  std::unique_ptr<Field> clone() const override { return std::make_unique<Transform>(*this); }
  bool moving() const override { return children_.moving() || slots_.moving(); }

  Interval range(const Box& box) const override {
    if (box.empty() || !box.finite()) return Interval::everything();
    Box local;
    for (int k = 0; k < 8; ++k) local.extend(local_point(corner(box, k)));
    // The rotated corners are rounded.
    return children_[0].range(local.padded(1e-12 * (local.diameter() + local.center().norm()))) * Interval(scale_);
  }

  Box bounds_below(double level) const override {
    const Box local = children_[0].bounds_below(level / scale_);
    if (local.empty()) return local;
    if (!local.finite()) return Box::everywhere();
    Box world;
    for (int k = 0; k < 8; ++k) world.extend(scale_ * (rotation_ * corner(local, k)) + shift_);
    return world;
  }

 protected:
  void do_evaluate(const Positions& x, const JetView& out) const override {
    for (std::size_t b = 0; b < x.size; b += kBlock) {
      const std::size_t n = std::min(kBlock, x.size - b);
      PositionBatch local(n);
      for (std::size_t i = 0; i < n; ++i) local.set(i, local_point(x[b + i]));
      const JetView part = out.part(b, n);
      children_[0].evaluate(local.view(), part);
      for (std::size_t i = 0; i < n; ++i) to_world(x[b + i], part, i);
    }
  }

  void do_material_velocity(const Positions& x, const VelocityView& out) const override {
    PositionBatch local(x.size);
    for (std::size_t i = 0; i < x.size; ++i) local.set(i, local_point(x[i]));
    children_[0].material_velocity(local.view(), out);
    const Mat3 turning = scale_rate_ * rotation_ + scale_ * rotation_rate_;
    for (std::size_t i = 0; i < x.size; ++i) {
      const Vec3 inner(out.x[i], out.y[i], out.z[i]);
      const Vec3 v = shift_rate_ + turning * local.view()[i] + scale_ * (rotation_ * inner);
      out.x[i] = v.x();
      out.y[i] = v.y();
      out.z[i] = v.z();
    }
  }

  void do_parameter_rows(const Positions& x, SparseRows& rows) const override;

  void do_set_parameters(std::span<const double> values, std::span<const double> rates) override {
    children_.set_parameters(values, rates);
    slots_.set_parameters(gather(values, map_), gather(rates, map_));
    refresh();
  }
  void do_set_time(double t) override {
    children_.set_time(t);
    if (slots_.set_time(t)) refresh();
  }

 private:
  static Vec3 corner(const Box& b, int k) {
    return {(k & 1) != 0 ? b.max.x() : b.min.x(), (k & 2) != 0 ? b.max.y() : b.min.y(),
            (k & 4) != 0 ? b.max.z() : b.min.z()};
  }
  Vec3 local_point(const Vec3& x) const { return inverse_ * (x - shift_); }

  void refresh();
  void to_world(const Vec3& x, const JetView& out, std::size_t i) const;

  Children children_;
  Slots slots_;
  std::vector<std::uint32_t> map_;
  Mat3 rotation_, rotation_rate_;
  Mat3 inverse_, inverse_rate_;  // M = Rᵀ/s and its rate
  Vec3 shift_, shift_rate_;
  double scale_ = 1, scale_rate_ = 0;
};

void Transform::refresh() {
  using J = jet::Jet1<double, 1>;
  J angle[3];
  for (std::size_t a = 0; a < 3; ++a) {
    shift_[static_cast<Eigen::Index>(a)] = slots_.value(0, a);
    shift_rate_[static_cast<Eigen::Index>(a)] = slots_.rate(0, a);
    angle[a] = {slots_.value(0, 3 + a), {slots_.rate(0, 3 + a)}};
  }
  const auto r = rotation(angle);
  for (int a = 0; a < 9; ++a) {
    rotation_(a / 3, a % 3) = r[static_cast<std::size_t>(a)].v;
    rotation_rate_(a / 3, a % 3) = r[static_cast<std::size_t>(a)].d[0];
  }
  scale_ = slots_.value(0, 6);
  scale_rate_ = slots_.rate(0, 6);
  inverse_ = rotation_.transpose() / scale_;
  inverse_rate_ = rotation_rate_.transpose() / scale_ - inverse_ * (scale_rate_ / scale_);
}

/// The chain rule for F(x, t) = s f(u(x, t), t) with u = M(x − τ).
void Transform::to_world(const Vec3& x, const JetView& out, std::size_t i) const {
  const double f = out.value(i);
  out.row(kF)[i] = scale_ * f;
  if (!has_gradient(out.order)) return;
  const Vec3 g = out.gradient(i);
  const Vec3 gradient = scale_ * (inverse_.transpose() * g);
  for (int a = 0; a < 3; ++a) out.row(kFx + static_cast<std::size_t>(a))[i] = gradient[a];

  const Vec3 u_t = inverse_rate_ * (x - shift_) - inverse_ * shift_rate_;
  if (has_time(out.order)) out.row(kFt)[i] = scale_rate_ * f + scale_ * (out.time(i) + g.dot(u_t));
  if (!has_hessian(out.order)) return;
  const Mat3 h = out.hessian(i);
  if (has_time(out.order)) {
    const Vec3 mixed = scale_rate_ * (inverse_.transpose() * g) +
                       scale_ * (inverse_.transpose() * (out.gradient_time(i) + h * u_t) + inverse_rate_.transpose() * g);
    for (int a = 0; a < 3; ++a) out.row(kFxt + static_cast<std::size_t>(a))[i] = mixed[a];
  }
  const Mat3 hessian = scale_ * (inverse_.transpose() * h * inverse_);
  for (std::size_t k = 0; k < 6; ++k) out.row(kFxx + k)[i] = hessian(jet::kRow[k], jet::kColumn[k]);
}

void Transform::do_parameter_rows(const Positions& x, SparseRows& rows) const {
  using J = jet::Jet1<double, kNumbers>;
  J q[kNumbers];
  for (std::size_t s = 0; s < kNumbers; ++s) q[s] = jet::variable<J>(slots_.value(0, s), static_cast<int>(s));
  PositionBatch local(x.size);
  for (std::size_t i = 0; i < x.size; ++i) local.set(i, local_point(x[i]));
  JetBatch jets(x.size, Order::Gradient);
  children_[0].evaluate(local.view(), jets.view());
  SparseRows inner;
  children_[0].parameter_rows(local.view(), inner);
  for (std::size_t i = 0; i < x.size; ++i) {
    children_.append_row(0, inner, i, scale_, rows);
    const Vec3 p = x[i];
    const auto u = to_local(p.data(), q);
    const Vec3 g = jets.gradient(i);
    for (std::size_t s = 0; s < kNumbers; ++s) {
      const auto unknown = slots_.unknown(0, s);
      if (!unknown) continue;
      rows.index.push_back(map_[*unknown]);
      rows.value.push_back((s == 6 ? jets.value(i) : 0) +
                           scale_ * (g.x() * u[0].d[s] + g.y() * u[1].d[s] + g.z() * u[2].d[s]));
    }
    rows.end_row();
  }
}

}  // namespace

std::unique_ptr<Field> transform(std::unique_ptr<Field> input, const Number3& translate, const Number3& rotate,
                                 const Number& scale) {
  const Number numbers[] = {translate[0], translate[1], translate[2], rotate[0], rotate[1], rotate[2], scale};
  std::vector<std::unique_ptr<Field>> inputs;
  inputs.push_back(std::move(input));
  return std::make_unique<Transform>(std::move(inputs), numbers);
}

}  // namespace meniscus::field
