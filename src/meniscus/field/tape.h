#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace meniscus::field {

/// What an instruction of a tape computes from its operands a, b and its number c.
enum class Op : std::uint8_t {
  Constant,  // c
  X,
  Y,
  Z,
  T,          // coordinates and time
  Parameter,  // parameter number a
  Negate,
  Square,
  Absolute,
  Sign,
  Floor,
  Sqrt,
  Exp,
  Log,
  Sin,
  Cos,
  Tan,
  Asin,
  Acos,
  Atan,
  Sinh,
  Cosh,
  Tanh,
  IntegerPower,  // a^c, c whole
  AddConstant,
  MultiplyConstant,  // a + c, a * c
  DivideConstant,    // a / c
  ConstantMinus,
  ConstantOver,  // c - a, c / a
  Add,
  Subtract,
  Multiply,
  Divide,
  Minimum,
  Maximum,  // the first where equal
  Power,
  Atan2,  // a^b, atan2(a, b)
};

/// Number of operands that are results of other instructions.
int operand_count(Op op);

struct Instruction {
  Op op;
  std::uint32_t target;  ///< register written
  std::uint32_t a, b;    ///< registers read (Parameter: a is its number)
  double c;
};

/// A formula as straight-line code over registers.
struct Tape {
  std::vector<Instruction> code;  ///< the first `uniform` ones are the same at all points: functions of t and parameters
  std::size_t uniform = 0;
  std::uint32_t registers = 0;  ///< uniform results keep theirs; the others are reused
  std::uint32_t result = 0;
  bool uses_position = false;
  bool uses_time = false;
  std::vector<bool> uses_parameter;
};

/// Builds a directed acyclic graph of operations: equal ones are one node, operations on constants are done at once.
/// Results may differ from the text's in the last bit only where a constant was folded.
class Graph {
 public:
  using Node = std::uint32_t;

  explicit Graph(std::size_t parameters) : parameters_(parameters), table_(64, 0) {}

  Node constant(double value) { return node(Op::Constant, 0, 0, value); }
  Node variable(Op op) { return node(op); }
  Node parameter(std::uint32_t index) { return node(Op::Parameter, index); }
  /// One operand.
  Node apply(Op op, Node a);
  /// Two operands; op is Add, Subtract, Multiply, Divide, Minimum, Maximum, Power or Atan2.
  Node apply(Op op, Node a, Node b);

  /// Code for `root` and what it needs.
  Tape tape(Node root) const;

 private:
  struct Entry {
    Op op;
    std::uint32_t a, b;
    double c;
  };
  Node node(Op op, std::uint32_t a = 0, std::uint32_t b = 0, double c = 0);
  void grow();
  bool is_constant(Node n) const { return entries_[n].op == Op::Constant; }
  Node with_constant(Op op, Node a, Node b);
  Node power(Node a, Node b);

  std::size_t parameters_;
  std::vector<Entry> entries_;
  std::vector<std::uint32_t> table_;  // open addressing: node + 1, or 0; size a power of two
};

}  // namespace meniscus::field
