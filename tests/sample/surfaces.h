#pragma once

#include <meniscus/field/blobs.h>
#include <meniscus/field/field.h>
#include <meniscus/field/primitives.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

namespace meniscus::sample::test {

inline field::Number3 at(double x, double y, double z) { return {x, y, z}; }

inline std::unique_ptr<field::Field> sphere(double radius = 1, const Vec3& c = Vec3::Zero()) {
  return field::sphere(at(c.x(), c.y(), c.z()), radius);
}
inline std::unique_ptr<field::Field> torus(double major, double minor) {
  return field::torus(at(0, 0, 0), at(0, 0, 1), major, minor);
}
/// Gaussian blobs of radius 0.6·scale at the corners of a triangle: one body with three lobes.
inline std::unique_ptr<field::Field> three_blobs(double scale = 1) {
  const double s = scale;
  const field::Blob items[] = {
      {at(-0.6 * s, 0, 0), 0.6 * s, 1}, {at(0.6 * s, 0, 0), 0.6 * s, 1}, {at(0, 0.8 * s, 0.1 * s), 0.6 * s, 1}};
  return field::blobs(field::BlobKernel::Gaussian, 0.35, items);
}

/// A field from a function that writes F, ∇F, F_t and H (six numbers) at a point; knows no useful bounds.
class FunctionField : public field::Field {
 public:
  struct Jet {
    double f = 0;
    Vec3 g = Vec3::Zero();
    double t = 0;
    Mat3 h = Mat3::Zero();
  };
  using Function = std::function<Jet(const Vec3&, double time)>;

  explicit FunctionField(Function function, bool moving = false) : function_(std::move(function)), moving_(moving) {}
  std::unique_ptr<field::Field> clone() const override { return std::make_unique<FunctionField>(*this); }
  field::Interval range(const Box&) const override { return field::Interval::everything(); }
  Box bounds_below(double) const override { return Box::everywhere(); }
  bool moving() const override { return moving_; }

 protected:
  void do_evaluate(const field::Positions& x, const field::JetView& out) const override {
    using namespace field;
    for (std::size_t i = 0; i < x.size; ++i) {
      const Jet j = function_(x[i], time());
      out.row(kF)[i] = j.f;
      if (has_gradient(out.order))
        for (int a = 0; a < 3; ++a) out.row(kFx + static_cast<std::size_t>(a))[i] = j.g[a];
      if (has_time(out.order)) out.row(kFt)[i] = j.t;
      if (!has_hessian(out.order)) continue;
      out.row(kFxx)[i] = j.h(0, 0);
      out.row(kFxy)[i] = j.h(0, 1);
      out.row(kFxz)[i] = j.h(0, 2);
      out.row(kFyy)[i] = j.h(1, 1);
      out.row(kFyz)[i] = j.h(1, 2);
      out.row(kFzz)[i] = j.h(2, 2);
    }
  }

  void do_material_velocity(const field::Positions& x, const field::VelocityView& out) const override {
    for (double* row : {out.x, out.y, out.z}) std::fill_n(row, x.size, 0.0);
  }

 private:
  Function function_;
  bool moving_;
};

/// sin x cos y + sin y cos z + sin z cos x at frequency k; cut by whatever box it is sampled in.
inline std::unique_ptr<field::Field> gyroid(double k = 3) {
  return std::make_unique<FunctionField>([k](const Vec3& p, double) {
    const Vec3 s = (k * p).array().sin(), c = (k * p).array().cos();
    FunctionField::Jet j;
    j.f = s.x() * c.y() + s.y() * c.z() + s.z() * c.x();
    j.g = k * Vec3(c.x() * c.y() - s.z() * s.x(), c.y() * c.z() - s.x() * s.y(), c.z() * c.x() - s.y() * s.z());
    j.h << -s.x() * c.y() - s.z() * c.x(), -c.x() * s.y(), -c.z() * s.x(),  //
        -c.x() * s.y(), -s.y() * c.z() - s.x() * c.y(), -c.y() * s.z(),     //
        -c.z() * s.x(), -c.y() * s.z(), -s.z() * c.x() - s.y() * c.z();
    j.h *= k * k;
    return j;
  });
}

}  // namespace meniscus::sample::test
