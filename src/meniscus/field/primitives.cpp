#include <meniscus/base/error.h>
#include <meniscus/field/cpu.h>
#include <meniscus/field/primitives.h>
#include <meniscus/field/primitives.kernel.h>
#include <meniscus/field/segment.h>

#include <Eigen/Geometry>

#include <cmath>
#include <limits>
#include <string>

namespace meniscus::field {
namespace {

const ShapeTable kShapesSse2 = MENISCUS_SHAPE_TABLE(packet::Sse2);

using meniscus::Box;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Vec3 vec(const double* q) { return {q[0], q[1], q[2]}; }

// What a primitive knows beside its formula. `q` are the slots, `r` their rates.
struct Traits {
  Shape shape;
  std::string_view name;
  std::vector<SlotInfo> slots;
  Box (*bounds)(const double* q, double level);                       // of F <= level
  double (*lipschitz)(const double* q);                               // bound on |∇F|
  Vec3 (*velocity)(const double* q, const double* r, const Vec3& x);  // of the material at x
  void (*row)(const double* q, const double* x, double* dq);          // ∂F/∂q
};

template <class S>
void row(const double* q, const double* x, double* dq) {
  using J = jet::Jet1<double, S::kSlots>;
  J slots[S::kSlots];
  for (int s = 0; s < S::kSlots; ++s) slots[s] = jet::variable<J>(q[s], s);
  const J f = S::value(x, slots);
  for (int s = 0; s < S::kSlots; ++s) dq[s] = f.d[s];
}

double distance_lipschitz(const double*) { return 1; }

Vec3 velocity_of_center(const double*, const double* r, const Vec3&) { return vec(r); }

// Turning of a direction: ω with d' = ω × d for the unit direction.
Vec3 turning(const Vec3& d, const Vec3& rate) { return d.cross(rate) / d.squaredNorm(); }

Vec3 velocity_about_axis(const double* q, const double* r, const Vec3& x) {
  return vec(r) + turning(vec(q + 3), vec(r + 3)).cross(x - vec(q));
}

constexpr SlotInfo center(std::string_view n) { return {n, Quantity::Coordinate, -kInfinity}; }
constexpr SlotInfo length_slot(std::string_view n) { return {n, Quantity::Length, 0}; }
constexpr SlotInfo ratio(std::string_view n) { return {n, Quantity::Ratio, -kInfinity}; }

const Traits kSphere{Shape::Sphere,
                     "sphere",
                     {center("center.x"), center("center.y"), center("center.z"), length_slot("radius")},
                     [](const double* q, double level) { return Box::around(vec(q), q[3]).padded(level); },
                     distance_lipschitz,
                     velocity_of_center,
                     row<shapes::Sphere>};

const Traits kBox{Shape::Box,
                  "box",
                  {center("center.x"), center("center.y"), center("center.z"), length_slot("size.x"), length_slot("size.y"),
                   length_slot("size.z")},
                  [](const double* q, double level) {
                    return Box{vec(q) - 0.5 * vec(q + 3), vec(q) + 0.5 * vec(q + 3)}.padded(level);
                  },
                  distance_lipschitz,
                  velocity_of_center,
                  row<shapes::Box>};

const Traits kTorus{Shape::Torus,
                    "torus",
                    {center("center.x"), center("center.y"), center("center.z"), ratio("axis.x"), ratio("axis.y"),
                     ratio("axis.z"), length_slot("major"), length_slot("minor")},
                    [](const double* q, double level) {
                      // A circle of radius R about a unit axis a reaches R √(1 − a_i²) along axis i.
                      const Vec3 a = vec(q + 3).normalized();
                      const Vec3 reach = q[6] * (Vec3::Ones() - a.cwiseProduct(a)).cwiseMax(0).cwiseSqrt();
                      return Box{vec(q) - reach, vec(q) + reach}.padded(q[7] + level);
                    },
                    distance_lipschitz,
                    velocity_about_axis,
                    row<shapes::Torus>};

const Traits kCapsule{
    Shape::Capsule,
    "capsule",
    {center("a.x"), center("a.y"), center("a.z"), center("b.x"), center("b.y"), center("b.z"), length_slot("radius")},
    [](const double* q, double level) {
      Box b;
      b.extend(vec(q));
      b.extend(vec(q + 3));
      return b.padded(q[6] + level);
    },
    distance_lipschitz,
    segment_velocity,
    row<shapes::Capsule>};

const Traits kPlane{
    Shape::Plane,
    "plane",
    {center("point.x"), center("point.y"), center("point.z"), ratio("normal.x"), ratio("normal.y"), ratio("normal.z")},
    [](const double*, double) { return Box::everywhere(); },
    distance_lipschitz,
    velocity_about_axis,
    row<shapes::Plane>};

const Traits kEllipsoid{Shape::Ellipsoid,
                        "ellipsoid",
                        {center("center.x"), center("center.y"), center("center.z"), length_slot("radii.x"),
                         length_slot("radii.y"), length_slot("radii.z")},
                        [](const double* q, double level) {
                          const double grown = 1 + level * vec(q + 3).cwiseInverse().sum() / 3;
                          const Vec3 r = vec(q + 3) * std::max(0.0, grown);
                          return Box{vec(q) - r, vec(q) + r};
                        },
                        [](const double* q) {
                          const Vec3 r = vec(q + 3);
                          return 3 / r.cwiseInverse().sum() / r.minCoeff();
                        },
                        velocity_of_center,
                        row<shapes::Ellipsoid>};

class Primitive final : public Field {
 public:
  Primitive(const Traits& traits, std::span<const Number> numbers) : traits_(&traits), slots_(traits.slots, 1) {
    for (std::size_t s = 0; s < numbers.size(); ++s) slots_.bind(0, s, numbers[s], std::string(traits.slots[s].name));
    parameters_ = slots_.parameters();
    refresh();
    check();
  }

  std::unique_ptr<Field> clone() const override { return std::make_unique<Primitive>(*this); }
  Box bounds_below(double level) const override { return traits_->bounds(q_, level); }
  bool moving() const override { return slots_.moving(); }

  Interval range(const Box& box) const override {
    if (box.empty() || !box.finite()) return Interval::everything();
    const double middle = value_at(*this, box.center());
    const double reach = traits_->lipschitz(q_) * 0.5 * box.diameter() * (1 + 1e-12);
    return {middle - reach, middle + reach};
  }

 protected:
  void do_evaluate(const Positions& x, const JetView& out) const override {
    const auto index = static_cast<std::size_t>(traits_->shape);
    (has_avx2() ? kShapesAvx2[index] : kShapesSse2[index])(q_, slots_.moving() ? rate_ : nullptr, x, out);
  }

  void do_material_velocity(const Positions& x, const VelocityView& out) const override {
    for (std::size_t i = 0; i < x.size; ++i) {
      const Vec3 v = traits_->velocity(q_, rate_, x[i]);
      out.x[i] = v.x();
      out.y[i] = v.y();
      out.z[i] = v.z();
    }
  }

  void do_parameter_rows(const Positions& x, SparseRows& rows) const override {
    double dq[kMaxSlots];
    for (std::size_t i = 0; i < x.size; ++i) {
      const Vec3 p = x[i];
      traits_->row(q_, p.data(), dq);
      for (std::size_t s = 0; s < slots_.slots(); ++s)
        if (const auto unknown = slots_.unknown(0, s)) {
          rows.index.push_back(*unknown);
          rows.value.push_back(dq[s]);
        }
      rows.end_row();
    }
  }

  void do_set_parameters(std::span<const double> values, std::span<const double> rates) override {
    slots_.set_parameters(values, rates);
    refresh();
  }

  void do_set_time(double t) override {
    if (slots_.set_time(t)) refresh();
  }

 private:
  void refresh() {
    for (std::size_t s = 0; s < slots_.slots(); ++s) {
      q_[s] = slots_.value(0, s);
      rate_[s] = slots_.rate(0, s);
    }
  }

  void check() const {
    const auto fail = [&](const std::string& what) { throw InvalidInput(std::string(traits_->name) + ": " + what); };
    for (std::size_t s = 0; s < slots_.slots(); ++s) {
      if (!std::isfinite(q_[s])) fail(std::string(traits_->slots[s].name) + " is not finite");
      if (q_[s] < traits_->slots[s].min) fail(std::string(traits_->slots[s].name) + " must not be negative");
    }
    if ((traits_->shape == Shape::Torus || traits_->shape == Shape::Plane) && vec(q_ + 3).norm() == 0)
      fail("the direction must not be zero");
    if (traits_->shape == Shape::Ellipsoid && vec(q_ + 3).minCoeff() <= 0) fail("radii must be above zero");
  }

  const Traits* traits_;
  Slots slots_;
  double q_[kMaxSlots] = {};
  double rate_[kMaxSlots] = {};
};

template <std::size_t N>
std::unique_ptr<Field> make(const Traits& traits, const Number (&numbers)[N]) {
  return std::make_unique<Primitive>(traits, std::span<const Number>(numbers, N));
}

}  // namespace

std::unique_ptr<Field> sphere(const Number3& c, const Number& radius) { return make(kSphere, {c[0], c[1], c[2], radius}); }

std::unique_ptr<Field> box(const Number3& c, const Number3& size) {
  return make(kBox, {c[0], c[1], c[2], size[0], size[1], size[2]});
}

std::unique_ptr<Field> torus(const Number3& c, const Number3& axis, const Number& major, const Number& minor) {
  return make(kTorus, {c[0], c[1], c[2], axis[0], axis[1], axis[2], major, minor});
}

std::unique_ptr<Field> capsule(const Number3& a, const Number3& b, const Number& radius) {
  return make(kCapsule, {a[0], a[1], a[2], b[0], b[1], b[2], radius});
}

std::unique_ptr<Field> plane(const Number3& p, const Number3& n) {
  return make(kPlane, {p[0], p[1], p[2], n[0], n[1], n[2]});
}

std::unique_ptr<Field> ellipsoid(const Number3& c, const Number3& r) {
  return make(kEllipsoid, {c[0], c[1], c[2], r[0], r[1], r[2]});
}

}  // namespace meniscus::field
