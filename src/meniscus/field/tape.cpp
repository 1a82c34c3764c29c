#include <meniscus/field/tape.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace meniscus::field {

namespace {

constexpr double kMostIntegerPower = 1024;

bool commutes(Op op) { return op == Op::Add || op == Op::Multiply; }

double fold(Op op, double a, double b) {
  switch (op) {
    case Op::Negate: return -a;
    case Op::Square: return a * a;
    case Op::Absolute: return std::abs(a);
    case Op::Sign: return a > 0 ? 1 : a < 0 ? -1 : a;
    case Op::Floor: return std::floor(a);
    case Op::Sqrt: return std::sqrt(a);
    case Op::Exp: return std::exp(a);
    case Op::Log: return std::log(a);
    case Op::Sin: return std::sin(a);
    case Op::Cos: return std::cos(a);
    case Op::Tan: return std::tan(a);
    case Op::Asin: return std::asin(a);
    case Op::Acos: return std::acos(a);
    case Op::Atan: return std::atan(a);
    case Op::Sinh: return std::sinh(a);
    case Op::Cosh: return std::cosh(a);
    case Op::Tanh: return std::tanh(a);
    case Op::Add: return a + b;
    case Op::Subtract: return a - b;
    case Op::Multiply: return a * b;
    case Op::Divide: return a / b;
    case Op::Minimum: return b < a ? b : a;
    case Op::Maximum: return b > a ? b : a;
    case Op::Power: return std::pow(a, b);
    case Op::Atan2: return std::atan2(a, b);
    default: return std::nan("");
  }
}

std::uint64_t mix(std::uint64_t h, std::uint64_t v) {
  h = (h ^ v) * 0x9E3779B97F4A7C15ull;
  return h ^ (h >> 29);
}

}  // namespace

int operand_count(Op op) {
  if (op <= Op::Parameter) return 0;
  return op < Op::Add ? 1 : 2;
}

Graph::Node Graph::node(Op op, std::uint32_t a, std::uint32_t b, double c) {
  if (2 * (entries_.size() + 1) > table_.size()) grow();
  const auto bits = std::bit_cast<std::uint64_t>(c);
  const auto hash = mix(mix(mix(mix(0, static_cast<std::uint64_t>(op)), a), b), bits);
  const std::size_t mask = table_.size() - 1;
  std::size_t place = hash & mask;
  for (; table_[place] != 0; place = (place + 1) & mask) {
    const Entry& e = entries_[table_[place] - 1];
    if (e.op == op && e.a == a && e.b == b && std::bit_cast<std::uint64_t>(e.c) == bits) return table_[place] - 1;
  }
  entries_.push_back({op, a, b, c});
  table_[place] = static_cast<std::uint32_t>(entries_.size());
  return table_[place] - 1;
}

void Graph::grow() {
  std::vector<Entry> entries = std::move(entries_);
  table_.assign(2 * table_.size(), 0);
  entries_.clear();
  entries_.reserve(2 * entries.size());
  for (const Entry& e : entries) node(e.op, e.a, e.b, e.c);
}

Graph::Node Graph::apply(Op op, Node a) {
  if (is_constant(a)) return constant(fold(op, entries_[a].c, 0));
  if (op == Op::Negate && entries_[a].op == Op::Negate) return entries_[a].a;
  return node(op, a);
}

Graph::Node Graph::apply(Op op, Node a, Node b) {
  if (is_constant(a) && is_constant(b)) return constant(fold(op, entries_[a].c, entries_[b].c));
  if (op == Op::Power) return power(a, b);
  if (op == Op::Multiply && a == b) return node(Op::Square, a);
  if ((is_constant(a) || is_constant(b)) && op >= Op::Add && op <= Op::Divide) return with_constant(op, a, b);
  if (commutes(op) && b < a) std::swap(a, b);
  return node(op, a, b);
}

Graph::Node Graph::with_constant(Op op, Node a, Node b) {
  const bool first = is_constant(a);
  const double c = entries_[first ? a : b].c;
  const Node x = first ? b : a;
  switch (op) {
    case Op::Add: return c == 0 ? x : node(Op::AddConstant, x, 0, c);
    case Op::Subtract:
      if (first) return c == 0 ? apply(Op::Negate, x) : node(Op::ConstantMinus, x, 0, c);
      return c == 0 ? x : node(Op::AddConstant, x, 0, -c);
    case Op::Multiply:
      if (c == -1) return apply(Op::Negate, x);
      return c == 1 ? x : node(Op::MultiplyConstant, x, 0, c);
    default:
      if (first) return node(Op::ConstantOver, x, 0, c);
      return c == 1 ? x : node(Op::DivideConstant, x, 0, c);
  }
}

Graph::Node Graph::power(Node a, Node b) {
  if (is_constant(b)) {
    const double c = entries_[b].c;
    if (c == 0) return constant(1);
    if (c == 1) return a;
    if (c == 2) return node(Op::Square, a);
    if (c == 0.5) return node(Op::Sqrt, a);
    if (c == std::floor(c) && std::abs(c) <= kMostIntegerPower) return node(Op::IntegerPower, a, 0, c);
  }
  if (is_constant(a) && entries_[a].c > 0 && std::isfinite(entries_[a].c))
    return apply(Op::Exp, apply(Op::Multiply, constant(std::log(entries_[a].c)), b));
  return node(Op::Power, a, b);
}

Tape Graph::tape(Node root) const {
  // What the root needs, what depends on position, and who reads a result last. Operands come before their readers.
  const std::size_t n = root + 1;
  std::vector<bool> needed(n), varies(n);
  std::vector<Node> last_reader(n, 0);
  needed[root] = true;
  const auto each_operand = [&](Node i, const auto& visit) {
    const int count = operand_count(entries_[i].op);
    if (count > 0) visit(entries_[i].a);
    if (count > 1) visit(entries_[i].b);
  };
  for (Node i = root + 1; i-- > 0;)
    if (needed[i])
      each_operand(i, [&](Node a) {
        needed[a] = true;
        last_reader[a] = std::max(last_reader[a], i);
      });
  for (Node i = 0; i < n; ++i) {
    varies[i] = entries_[i].op == Op::X || entries_[i].op == Op::Y || entries_[i].op == Op::Z;
    each_operand(i, [&](Node a) { varies[i] = varies[i] || varies[a]; });
  }

  Tape tape;
  tape.uses_parameter.resize(parameters_);
  std::vector<std::uint32_t> place(n), free;
  const auto emit = [&](Node i) {
    const Entry& e = entries_[i];
    Instruction code{e.op, 0, e.a, e.b, e.c};
    const int count = operand_count(e.op);
    if (count > 0) code.a = place[e.a];
    if (count > 1) code.b = place[e.b];
    if (varies[i])
      each_operand(i, [&](Node a) {
        if (varies[a] && last_reader[a] == i) {
          free.push_back(place[a]);
          last_reader[a] = 0;  // not twice for a operation on one operand with itself
        }
      });
    if (varies[i] && !free.empty()) {
      place[i] = free.back();
      free.pop_back();
    } else {
      place[i] = tape.registers++;
    }
    code.target = place[i];
    tape.code.push_back(code);
    tape.uses_time = tape.uses_time || e.op == Op::T;
    if (e.op == Op::Parameter) tape.uses_parameter[e.a] = true;
  };
  for (Node i = 0; i < n; ++i)
    if (needed[i] && !varies[i]) emit(i);
  tape.uniform = tape.code.size();
  for (Node i = 0; i < n; ++i)
    if (needed[i] && varies[i]) emit(i);
  tape.uses_position = varies[root];
  tape.result = place[root];
  return tape;
}

}  // namespace meniscus::field
