#pragma once

// Private to primitives.cpp and primitives.avx2.cpp.
#include <meniscus/field/jets.h>
#include <meniscus/field/packet.h>
#include <meniscus/field/shapes.h>

namespace meniscus::field {

enum class Shape : int { Sphere, Box, Torus, Capsule, Plane, Ellipsoid };
inline constexpr int kShapes = 6;
inline constexpr int kMaxSlots = 8;

/// Evaluates one primitive at many points. `q` are the slots; `qdot` their rates, null when at rest.
using EvaluateShape = void (*)(const double* q, const double* qdot, const Positions& x, const JetView& out);
using ShapeTable = EvaluateShape[kShapes];

extern const ShapeTable kShapesAvx2;

namespace kernel {

template <class Shape, class X, class Q, class T>
void evaluate_packet(const T* point, const Q* q, bool moving, const JetView& out, std::size_t i, std::size_t lanes) {
  X x[3];
  for (int a = 0; a < 3; ++a) x[a] = packet::coordinate<X>(point[a], a);
  packet::store(Shape::value(x, q), moving, out, i, lanes);
}

/// Loops over packets of points with numbers of type X for positions and Q for slots.
template <class Shape, class T, class X, class Q>
void evaluate_as(const Q* q, bool moving, const Positions& x, const JetView& out) {
  for (std::size_t i = 0; i < x.size; i += T::size) {
    const std::size_t lanes = packet::lanes<T>(x.size - i);
    const T point[3] = {packet::load<T>(x.x + i, lanes), packet::load<T>(x.y + i, lanes), packet::load<T>(x.z + i, lanes)};
    evaluate_packet<Shape, X>(point, q, moving, out, i, lanes);
  }
}

template <class Shape, class T>
void evaluate(const double* slots, const double* rates, const Positions& x, const JetView& out) {
  using J1 = jet::Jet1<T, 4>;
  using J2 = jet::Jet2<T, 4>;
  T q[Shape::kSlots];
  for (int s = 0; s < Shape::kSlots; ++s) q[s] = T(slots[s]);
  if (rates != nullptr && has_time(out.order)) {
    if (out.order == Order::GradientTime) {
      J1 m[Shape::kSlots];
      for (int s = 0; s < Shape::kSlots; ++s) m[s] = packet::moving<J1>(slots[s], rates[s]);
      evaluate_as<Shape, T, J1>(m, true, x, out);
    } else {
      J2 m[Shape::kSlots];
      for (int s = 0; s < Shape::kSlots; ++s) m[s] = packet::moving<J2>(slots[s], rates[s]);
      evaluate_as<Shape, T, J2>(m, true, x, out);
    }
    return;
  }
  switch (out.order) {
    case Order::Value: evaluate_as<Shape, T, T>(q, false, x, out); break;
    case Order::Gradient:
    case Order::GradientTime: evaluate_as<Shape, T, jet::Jet1<T, 3>>(q, false, x, out); break;
    case Order::Hessian:
    case Order::HessianTime: evaluate_as<Shape, T, jet::Jet2<T, 3>>(q, false, x, out); break;
  }
}

}  // namespace kernel

/// One entry per Shape, in its order.
#define MENISCUS_SHAPE_TABLE(T)                                                                                          \
  {                                                                                                                      \
    kernel::evaluate<shapes::Sphere, T>, kernel::evaluate<shapes::Box, T>, kernel::evaluate<shapes::Torus, T>,           \
        kernel::evaluate<shapes::Capsule, T>, kernel::evaluate<shapes::Plane, T>, kernel::evaluate<shapes::Ellipsoid, T> \
  }

}  // namespace meniscus::field
