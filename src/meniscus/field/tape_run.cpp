#include <meniscus/field/tape_run.h>

#include <meniscus/field/cpu.h>
#include <meniscus/field/expression.kernel.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

namespace meniscus::field {

namespace {

constexpr std::size_t kScratchInCache = 24 * 1024;  // bytes of registers that a chunk of points should not exceed
constexpr std::size_t kMostPackets = 32;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::size_t jet_doubles(Order order) { return row_count(order) == 1 ? 1 : row_count(order); }

}  // namespace

void run_tape(const Tape& tape, const TapeState& state, const Positions& x, const JetView& out) {
  const bool wide = has_avx2();
  const std::size_t lanes = wide ? 4 : 2;
  const std::size_t jet = jet_doubles(out.order) * lanes * sizeof(double);
  std::size_t packets = std::clamp<std::size_t>(kScratchInCache / (jet * tape.registers), 1, kMostPackets);
  packets = std::min(packets, (x.size + lanes - 1) / lanes);
  if (packets == 0) return;

  constexpr std::size_t kAlignment = 64;
  const std::unique_ptr<double[]> storage(
      new double[(tape.registers * packets * kLargestJet + kAlignment) / sizeof(double)]);
  void* aligned = storage.get();
  std::size_t space = tape.registers * packets * kLargestJet + kAlignment;
  aligned = std::align(kAlignment, space - kAlignment, aligned, space);

  const TapeInputs inputs{&tape,
                          state.values.data(),
                          state.seeds.data(),
                          state.variables,
                          state.time,
                          state.moving,
                          static_cast<double*>(aligned),
                          packets};
  (wide ? kRunTapeAvx2 : kernel::run_tape<packet::Sse2>)(inputs, x, out);
}

// ---- intervals
// ------------------------------------------------------------------------------------------------------------

namespace {

/// Between the values at the ends, for a function that rises or falls throughout.
template <class F>
Interval monotone(Interval a, const F& f) {
  const double p = f(a.lo), q = f(a.hi);
  return {std::min(p, q), std::max(p, q)};
}

/// The same within the function's domain; everything when `a` lies outside.
template <class F>
Interval monotone_within(Interval a, double lo, double hi, const F& f) {
  if (a.hi < lo || a.lo > hi) return Interval::everything();
  return monotone({std::max(a.lo, lo), std::min(a.hi, hi)}, f);
}

template <class F>
Interval of_corners(Interval a, Interval b, const F& f) {
  const double p = f(a.lo, b.lo), q = f(a.lo, b.hi), r = f(a.hi, b.lo), s = f(a.hi, b.hi);
  return {std::min({p, q, r, s}), std::max({p, q, r, s})};
}

Interval tangent(Interval a) {
  const double turns = std::floor(a.lo / std::numbers::pi + 0.5);
  if (!(a.hi < (turns + 0.5) * std::numbers::pi - 1e-15 * std::abs(a.hi))) return Interval::everything();
  return monotone(a, [](double v) { return std::tan(v); });
}

Interval integer_power(Interval a, double n) {
  if (n < 0) return Interval(1) / integer_power(a, -n);
  const auto f = [n](double v) { return std::pow(v, n); };
  return std::fmod(n, 2) == 0 ? monotone(abs(a), f) : monotone(a, f);
}

Interval power(Interval a, Interval b) {
  const auto f = [](double x, double n) { return std::pow(x, n); };
  if (a.lo < 0 && b.lo == b.hi && b.lo != std::floor(b.lo)) {  // has a value only for a >= 0
    if (a.hi < 0) return Interval::everything();
    a.lo = 0;
  }
  const bool rises_or_falls = a.lo > 0 || (a.lo == 0 && b.lo >= 0);
  return rises_or_falls ? of_corners(a, b, f) : Interval::everything();
}

Interval angle(Interval y, Interval x) {
  if (x.lo <= 0 && y.contains_zero()) return {-std::numbers::pi, std::numbers::pi};
  return of_corners(y, x, [](double b, double a) { return std::atan2(b, a); });
}

Interval unary(Op op, Interval a, double c) {
  switch (op) {
    case Op::Negate: return -a;
    case Op::Square: return sqr(a);
    case Op::Absolute: return abs(a);
    case Op::Sign: return {a.lo > 0 ? 1.0 : a.lo < 0 ? -1.0 : 0.0, a.hi > 0 ? 1.0 : a.hi < 0 ? -1.0 : 0.0};
    case Op::Floor: return {std::floor(a.lo), std::floor(a.hi)};
    case Op::Sqrt: return monotone_within(a, 0, kInfinity, [](double v) { return std::sqrt(v); });
    case Op::Exp: return exp(a);
    case Op::Log: return monotone_within(a, 0, kInfinity, [](double v) { return std::log(v); });
    case Op::Sin: return sin(a);
    case Op::Cos: return cos(a);
    case Op::Tan: return tangent(a);
    case Op::Asin: return monotone_within(a, -1, 1, [](double v) { return std::asin(v); });
    case Op::Acos: return monotone_within(a, -1, 1, [](double v) { return std::acos(v); });
    case Op::Atan: return monotone(a, [](double v) { return std::atan(v); });
    case Op::Sinh: return monotone(a, [](double v) { return std::sinh(v); });
    case Op::Cosh: return monotone(abs(a), [](double v) { return std::cosh(v); });
    case Op::Tanh: return monotone(a, [](double v) { return std::tanh(v); });
    case Op::IntegerPower: return integer_power(a, c);
    case Op::AddConstant: return a + Interval(c);
    case Op::MultiplyConstant: return a * Interval(c);
    case Op::DivideConstant: return a / Interval(c);
    case Op::ConstantMinus: return Interval(c) - a;
    case Op::ConstantOver: return Interval(c) / a;
    default: return Interval::everything();
  }
}

Interval binary(Op op, Interval a, Interval b) {
  switch (op) {
    case Op::Add: return a + b;
    case Op::Subtract: return a - b;
    case Op::Multiply: return a * b;
    case Op::Divide: return a / b;
    case Op::Minimum: return min(a, b);
    case Op::Maximum: return max(a, b);
    case Op::Power: return power(a, b);
    case Op::Atan2: return angle(a, b);
    default: return Interval::everything();
  }
}

/// Wider by what rounding may have cost in one operation, here and in the packets. Sine and its kin are accurate to a unit
/// in the last place of 1, not of themselves.
Interval widened(Op op, Interval a) {
  if (!(a.lo <= a.hi)) return Interval::everything();
  const auto slack = [op](double end) {
    const double size = std::abs(end);
    if (!std::isfinite(size)) return 0.0;
    const double absolute = op == Op::Sin || op == Op::Cos ? 1.0 : op == Op::Tan ? 1 + size * size : 0.0;
    return 1e-15 * (size + absolute) + std::numeric_limits<double>::min();
  };
  return {a.lo - slack(a.lo), a.hi + slack(a.hi)};
}

/// Whether the operation's result is never rounded.
bool exact(Op op) {
  return op <= Op::Negate || op == Op::Absolute || op == Op::Sign || op == Op::Floor || op == Op::Minimum ||
         op == Op::Maximum;
}

}  // namespace

Interval range_of_tape(const Tape& tape, const TapeState& state, const std::array<Interval, 3>& x) {
  std::vector<Interval> registers(tape.registers);
  for (const Instruction& i : tape.code) {
    Interval& to = registers[i.target];
    switch (i.op) {
      case Op::Constant: to = Interval(i.c); break;
      case Op::X: to = x[0]; break;
      case Op::Y: to = x[1]; break;
      case Op::Z: to = x[2]; break;
      case Op::T: to = Interval(state.time); break;
      case Op::Parameter: to = Interval(state.values[i.a]); break;
      default:
        to = operand_count(i.op) == 1 ? unary(i.op, registers[i.a], i.c) : binary(i.op, registers[i.a], registers[i.b]);
    }
    if (!exact(i.op) || !(to.lo <= to.hi)) to = widened(i.op, to);
  }
  return registers[tape.result];
}

}  // namespace meniscus::field
