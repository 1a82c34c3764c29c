#pragma once

// Private to expression.cpp and expression.avx2.cpp: runs a tape over packets of points, operation by operation.
#include <meniscus/field/jets.h>
#include <meniscus/field/packet.h>
#include <meniscus/field/tape.h>

#include <cmath>

namespace meniscus::field {

/// What a tape reads beside positions.
struct TapeInputs {
  const Tape* tape;
  const double* values;  ///< of the parameters
  const double* seeds;   ///< four per parameter: derivatives by the four variables of a jet
  bool variables;        ///< whether x, y, z, t are the variables that derivatives are taken by
  double time;
  bool moving;          ///< whether derivatives by time can differ from zero
  double* scratch;      ///< registers * packets jets, aligned to 64 bytes
  std::size_t packets;  ///< packets per chunk
};

using RunTape = void (*)(const TapeInputs& in, const Positions& x, const JetView& out);

/// Bytes of the largest jet of the widest packet, per register and packet.
inline constexpr std::size_t kLargestJet = 14 * 4 * sizeof(double);

extern const RunTape kRunTapeAvx2;

namespace kernel {

template <class T, class F>
T each_lane(const T& a, const F& f) {
  alignas(64) double v[T::size];
  a.store_aligned(v);
  for (std::size_t k = 0; k < T::size; ++k) v[k] = f(v[k]);
  return T::load_aligned(v);
}

template <class T, class F>
T each_lane(const T& a, const T& b, const F& f) {
  alignas(64) double v[T::size], w[T::size];
  a.store_aligned(v);
  b.store_aligned(w);
  for (std::size_t k = 0; k < T::size; ++k) v[k] = f(v[k], w[k]);
  return T::load_aligned(v);
}

/// Sine and cosine within 2 units in the last place of 1. A library's packet version chooses its method by all lanes
/// together, so a point's result would depend on its neighbours; here each lane goes its own way.
template <class T>
void sin_cos(const T& x, T& s, T& c) {
  // Take off k quarter turns in three exact steps; the remainder is within an eighth of a turn.
  const T k = nearbyint(x * T(0.63661977236758134308));
  const T r =
      ((x - k * T(1.57079632673412561417e+00)) - k * T(6.07710050630396597660e-11)) - k * T(2.02226624879595063154e-21);
  const T z = r * r;
  T p = T(1.58962301576546568060e-10);
  for (const double a : {-2.50507477628578072866e-8, 2.75573136213857245213e-6, -1.98412698295895385996e-4,
                         8.33333333332211858878e-3, -1.66666666666666307295e-1})
    p = p * z + T(a);
  T q = T(-1.13585365213876817300e-11);
  for (const double a : {2.08757008419747316778e-9, -2.75573141792967388112e-7, 2.48015872888517045348e-5,
                         -1.38888888888730564116e-3, 4.16666666666665929218e-2})
    q = q * z + T(a);
  const T sine = r + r * z * p, cosine = T(1.0) - T(0.5) * z + z * z * q;

  const T quarter = k - T(4.0) * floor(k * T(0.25));  // 0, 1, 2, 3
  const auto odd = quarter == T(1.0) || quarter == T(3.0);
  s = select(odd, cosine, sine);
  c = select(odd, sine, cosine);
  s = select(quarter >= T(2.0), T(-s), s);
  c = select(quarter == T(1.0) || quarter == T(2.0), T(-c), c);

  const auto far = !(abs(x) <= T(1e6));
  if (!any(far)) return;
  s = select(far, each_lane(x, [](double v) { return ::sin(v); }), s);
  c = select(far, each_lane(x, [](double v) { return ::cos(v); }), c);
}

/// A function's value and first two derivatives.
template <class T>
struct Curve {
  T f, f1, f2;
};

template <class J>
struct ScalarOf {
  using type = J;
};
template <jet::AnyJet J>
struct ScalarOf<J> {
  using type = typename J::Scalar;
};

template <class J, class F>
J lift(const J& a, const F& function) {
  if constexpr (jet::AnyJet<J>) {
    const auto c = function(a.v);
    return jet::chain(a, c.f, c.f1, c.f2);
  } else {
    return function(a).f;
  }
}

/// x^n for n >= 0.
template <class T>
T whole_power(T x, unsigned n) {
  T r(1.0);
  for (; n != 0; n >>= 1) {
    if (n & 1u) r = r * x;
    x = x * x;
  }
  return r;
}

template <class T>
Curve<T> integer_power(const T& x, int n) {
  const T a(n), b(static_cast<double>(n) * (n - 1));
  if (n >= 2) {
    const T p = whole_power(x, static_cast<unsigned>(n - 2));
    return {p * x * x, a * p * x, b * p};
  }
  const T inverse = T(1.0) / x;
  const T f = whole_power(inverse, static_cast<unsigned>(-n));
  return {f, a * f * inverse, b * f * inverse * inverse};
}

template <class J, class T = typename ScalarOf<J>::type>
J unary(Op op, const J& a, double c) {
  const T zero(0.0), one(1.0), two(2.0);
  switch (op) {
    case Op::Negate: return -a;
    case Op::Square: return lift(a, [&](const T& v) { return Curve<T>{v * v, two * v, two}; });
    case Op::Absolute: return jet::magnitude(a);
    case Op::Sign:
      return lift(a, [&](const T& v) { return Curve<T>{select(v > zero, one, select(v < zero, T(-1.0), v)), zero, zero}; });
    case Op::Floor: return lift(a, [&](const T& v) { return Curve<T>{floor(v), zero, zero}; });
    case Op::Sqrt:
      if constexpr (jet::AnyJet<J>)
        return jet::sqrt(a);
      else
        return sqrt(a);
    case Op::Exp:
      return lift(a, [&](const T& v) {
        const T f = exp(v);
        return Curve<T>{f, f, f};
      });
    case Op::Log:
      return lift(a, [&](const T& v) {
        const T f1 = one / v;
        return Curve<T>{log(v), f1, -(f1 * f1)};
      });
    case Op::Sin:
      return lift(a, [&](const T& v) {
        T s, k;
        sin_cos(v, s, k);
        return Curve<T>{s, k, -s};
      });
    case Op::Cos:
      return lift(a, [&](const T& v) {
        T s, k;
        sin_cos(v, s, k);
        return Curve<T>{k, -s, -k};
      });
    case Op::Tan:
      return lift(a, [&](const T& v) {
        T s, k;
        sin_cos(v, s, k);
        const T f = s / k, f1 = one + f * f;
        return Curve<T>{f, f1, two * f * f1};
      });
    case Op::Asin:
    case Op::Acos:
      return lift(a, [&](const T& v) {
        const T f1 = one / sqrt(one - v * v), f2 = v * f1 * f1 * f1;
        if (op == Op::Asin) return Curve<T>{each_lane(v, [](double u) { return ::asin(u); }), f1, f2};
        return Curve<T>{each_lane(v, [](double u) { return ::acos(u); }), -f1, -f2};
      });
    case Op::Atan:
      return lift(a, [&](const T& v) {
        const T f1 = one / (one + v * v);
        return Curve<T>{each_lane(v, [](double u) { return ::atan(u); }), f1, T(-2.0) * v * f1 * f1};
      });
    case Op::Sinh:
    case Op::Cosh:
      return lift(a, [&](const T& v) {
        const T s = each_lane(v, [](double u) { return ::sinh(u); }), k = each_lane(v, [](double u) { return ::cosh(u); });
        return op == Op::Sinh ? Curve<T>{s, k, s} : Curve<T>{k, s, k};
      });
    case Op::Tanh:
      return lift(a, [&](const T& v) {
        const T f = each_lane(v, [](double u) { return ::tanh(u); }), f1 = one - f * f;
        return Curve<T>{f, f1, T(-2.0) * f * f1};
      });
    case Op::IntegerPower: return lift(a, [&](const T& v) { return integer_power(v, static_cast<int>(c)); });
    case Op::AddConstant: return a + T(c);
    case Op::MultiplyConstant: return a * T(c);
    case Op::DivideConstant: return a / T(c);
    case Op::ConstantMinus: return T(c) - a;
    case Op::ConstantOver:
      return lift(a, [&](const T& v) {
        const T f = T(c) / v, inverse = one / v;
        return Curve<T>{f, -f * inverse, two * f * inverse * inverse};
      });
    default: return a;
  }
}

template <class J, class T = typename ScalarOf<J>::type>
J power(const J& a, const J& b) {
  const auto pow_lanes = [](const T& x, const T& y) {
    return each_lane(x, y, [](double u, double v) { return ::pow(u, v); });
  };
  if constexpr (!jet::AnyJet<J>) {
    return pow_lanes(a, b);
  } else {
    const T zero(0.0), one(1.0), n = b.v;
    const T f = pow_lanes(a.v, n), p1 = pow_lanes(a.v, n - one), p2 = pow_lanes(a.v, n - T(2.0));
    const T logarithm = select(a.v > zero, log(a.v), zero);  // the exponent's derivative exists only there
    const T fb = f * logarithm;
    return jet::chain(a, b, f, T(n * p1), fb, T(n * (n - one) * p2), T(p1 * (one + n * logarithm)), T(fb * logarithm));
  }
}

template <class J, class T = typename ScalarOf<J>::type>
J angle(const J& a, const J& b) {
  const auto f = [](const T& y, const T& x) { return each_lane(y, x, [](double u, double v) { return ::atan2(u, v); }); };
  if constexpr (!jet::AnyJet<J>) {
    return f(a, b);
  } else {
    const T w = T(1.0) / (a.v * a.v + b.v * b.v), p = a.v * w, q = b.v * w;
    const T mixed = p * p - q * q, twice = T(2.0) * p * q;
    return jet::chain(a, b, f(a.v, b.v), q, T(-p), T(-twice), mixed, twice);
  }
}

template <class J>
J binary(Op op, const J& a, const J& b) {
  switch (op) {
    case Op::Add: return a + b;
    case Op::Subtract: return a - b;
    case Op::Multiply: return a * b;
    case Op::Divide: return a / b;
    case Op::Minimum: return jet::least(a, b);
    case Op::Maximum: return jet::greatest(a, b);
    case Op::Power: return power(a, b);
    default: return angle(a, b);
  }
}

/// Where F is finite, so are its derivatives: zero where they do not exist.
template <class J>
void tidy(J& j) {
  if constexpr (jet::AnyJet<J>) {
    using T = typename J::Scalar;
    const T largest(1.7976931348623157e308), zero(0.0);
    const auto good = abs(j.v) <= largest;
    const auto fix = [&](T& d) { d = select(good && !(abs(d) <= largest), zero, d); };
    for (int i = 0; i < J::kFirst; ++i) fix(j.d[i]);
    if constexpr (J::kSecond > 0)
      for (int k = 0; k < J::kSecond; ++k) fix(j.h[k]);
  }
}

/// One run over the code with numbers of type J.
template <class J, class T>
class Machine {
 public:
  Machine(const TapeInputs& in, const Positions& x, const JetView& out)
      : in_(in), x_(x), out_(out), registers_(reinterpret_cast<J*>(in.scratch)) {}

  void run() {
    const Tape& tape = *in_.tape;
    const std::size_t per_chunk = in_.packets * T::size;
    execute(0, tape.uniform, 0, in_.packets);
    for (std::size_t first = 0; first < x_.size; first += per_chunk) {
      const std::size_t left = x_.size - first;
      const std::size_t packets = left < per_chunk ? (left + T::size - 1) / T::size : in_.packets;
      execute(tape.uniform, tape.code.size(), first, packets);
      for (std::size_t p = 0; p < packets; ++p) {
        const std::size_t i = first + p * T::size;
        J result = reg(tape.result)[p];
        tidy(result);
        packet::store(result, in_.moving, out_, i, packet::lanes<T>(x_.size - i));
      }
    }
  }

 private:
  J* reg(std::uint32_t r) { return registers_ + r * in_.packets; }

  void execute(std::size_t begin, std::size_t end, std::size_t first, std::size_t packets) {
    for (std::size_t n = begin; n < end; ++n) {
      const Instruction& i = in_.tape->code[n];
      if (i.op <= Op::Parameter)
        leaf(i, first, packets);
      else if (i.op < Op::Add)
        each_packet_of_unary(i, packets);
      else
        each_packet_of_binary(i, packets);
    }
  }

  void leaf(const Instruction& i, std::size_t first, std::size_t packets) {
    const double* axes[3] = {x_.x, x_.y, x_.z};
    J* to = reg(i.target);
    for (std::size_t p = 0; p < packets; ++p) {
      if (i.op == Op::Constant) {
        to[p] = fixed(i.c);
      } else if (i.op == Op::T) {
        to[p] = fixed(in_.time);
        if constexpr (jet::AnyJet<J>)
          if (J::kFirst > 3 && in_.variables) to[p].d[J::kFirst - 1] = T(1.0);
      } else if (i.op == Op::Parameter) {
        to[p] = fixed(in_.values[i.a]);
        if constexpr (jet::AnyJet<J>)
          if (J::kFirst > 3)
            for (int k = 0; k < J::kFirst; ++k) to[p].d[k] = T(in_.seeds[4 * i.a + static_cast<std::size_t>(k)]);
      } else {
        const int axis = static_cast<int>(i.op) - static_cast<int>(Op::X);
        const std::size_t at = first + p * T::size;
        to[p] = plain(packet::load<T>(axes[axis] + at, packet::lanes<T>(x_.size - at)));
        if constexpr (jet::AnyJet<J>)
          if (in_.variables) to[p].d[axis] = T(1.0);
      }
    }
  }

  static J plain(const T& value) {
    if constexpr (jet::AnyJet<J>)
      return jet::constant<J>(value);
    else
      return value;
  }
  static J fixed(double value) { return plain(T(value)); }

#define MENISCUS_UNARY(OP)                                                  \
  case OP:                                                                  \
    for (std::size_t p = 0; p < packets; ++p) to[p] = unary(OP, a[p], i.c); \
    return;
  void each_packet_of_unary(const Instruction& i, std::size_t packets) {
    J* to = reg(i.target);
    const J* a = reg(i.a);
    switch (i.op) {
      MENISCUS_UNARY(Op::Negate)
      MENISCUS_UNARY(Op::Square)
      MENISCUS_UNARY(Op::Absolute)
      MENISCUS_UNARY(Op::Sqrt)
      MENISCUS_UNARY(Op::Exp)
      MENISCUS_UNARY(Op::Sin)
      MENISCUS_UNARY(Op::Cos)
      MENISCUS_UNARY(Op::AddConstant)
      MENISCUS_UNARY(Op::MultiplyConstant)
      default:
        for (std::size_t p = 0; p < packets; ++p) to[p] = unary(i.op, a[p], i.c);
    }
  }
#undef MENISCUS_UNARY

  void each_packet_of_binary(const Instruction& i, std::size_t packets) {
    J* to = reg(i.target);
    const J* a = reg(i.a);
    const J* b = reg(i.b);
    switch (i.op) {
      case Op::Add:
        for (std::size_t p = 0; p < packets; ++p) to[p] = a[p] + b[p];
        return;
      case Op::Subtract:
        for (std::size_t p = 0; p < packets; ++p) to[p] = a[p] - b[p];
        return;
      case Op::Multiply:
        for (std::size_t p = 0; p < packets; ++p) to[p] = a[p] * b[p];
        return;
      default:
        for (std::size_t p = 0; p < packets; ++p) to[p] = binary(i.op, a[p], b[p]);
    }
  }

  const TapeInputs& in_;
  Positions x_;
  JetView out_;
  J* registers_;
};

template <class T>
void run_tape(const TapeInputs& in, const Positions& x, const JetView& out) {
  const bool time = in.moving && has_time(out.order);
  if (!has_gradient(out.order))
    Machine<T, T>(in, x, out).run();
  else if (has_hessian(out.order) && time)
    Machine<jet::Jet2<T, 4>, T>(in, x, out).run();
  else if (has_hessian(out.order))
    Machine<jet::Jet2<T, 3>, T>(in, x, out).run();
  else if (time)
    Machine<jet::Jet1<T, 4>, T>(in, x, out).run();
  else
    Machine<jet::Jet1<T, 3>, T>(in, x, out).run();
}

}  // namespace kernel

}  // namespace meniscus::field
