#include <meniscus/field/formula.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <vector>

namespace meniscus::field {

namespace {

constexpr std::size_t kLongest = 1'000'000;
constexpr int kDeepest = 200;

/// A name in quotes, cut when absurdly long.
std::string quoted(std::string_view name) { return std::string(1, '\'').append(name.substr(0, 40)).append("'"); }

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

// ---- names
// ----------------------------------------------------------------------------------------------------------------

using Node = Graph::Node;
using Arguments = std::vector<Node>;

Node ratio(Graph& g, Op op, Node a, double divisor) { return g.apply(Op::Divide, g.apply(op, a), g.constant(divisor)); }

Node chain(Graph& g, Op op, const Arguments& a) {
  Node r = a[0];
  for (std::size_t i = 1; i < a.size(); ++i) r = g.apply(op, r, a[i]);
  return r;
}

Node clamp(Graph& g, Node x, Node lo, Node hi) { return g.apply(Op::Minimum, g.apply(Op::Maximum, x, lo), hi); }

Node smoothstep(Graph& g, const Arguments& a) {
  const Node span = g.apply(Op::Subtract, a[1], a[0]);
  const Node s = clamp(g, g.apply(Op::Divide, g.apply(Op::Subtract, a[2], a[0]), span), g.constant(0), g.constant(1));
  const Node rest = g.apply(Op::Subtract, g.constant(3), g.apply(Op::Multiply, g.constant(2), s));
  return g.apply(Op::Multiply, g.apply(Op::Multiply, s, s), rest);
}

Node length(Graph& g, Arguments a) {
  for (Node& n : a) n = g.apply(Op::Multiply, n, n);
  return g.apply(Op::Sqrt, chain(g, Op::Add, a));
}

Node ceiling(Graph& g, Node a) { return g.apply(Op::Negate, g.apply(Op::Floor, g.apply(Op::Negate, a))); }

Node modulo(Graph& g, Node a, Node b) {
  return g.apply(Op::Subtract, a, g.apply(Op::Multiply, b, g.apply(Op::Floor, g.apply(Op::Divide, a, b))));
}

Node blend(Graph& g, Node a, Node b, Node t) {
  return g.apply(Op::Add, a, g.apply(Op::Multiply, g.apply(Op::Subtract, b, a), t));
}

template <Op op>
Node unary(Graph& g, const Arguments& a) {
  return g.apply(op, a[0]);
}
template <Op op>
Node binary(Graph& g, const Arguments& a) {
  return g.apply(op, a[0], a[1]);
}

struct Function {
  std::string_view name;
  std::size_t least, most;  // number of arguments
  Node (*build)(Graph&, const Arguments&);
};

constexpr std::size_t kAny = 1000;

const Function kFunctions[] = {
    {"abs", 1, 1, unary<Op::Absolute>},
    {"acos", 1, 1, unary<Op::Acos>},
    {"asin", 1, 1, unary<Op::Asin>},
    {"atan", 1, 1, unary<Op::Atan>},
    {"atan2", 2, 2, binary<Op::Atan2>},
    {"ceil", 1, 1, [](Graph& g, const Arguments& a) { return ceiling(g, a[0]); }},
    {"clamp", 3, 3, [](Graph& g, const Arguments& a) { return clamp(g, a[0], a[1], a[2]); }},
    {"cos", 1, 1, unary<Op::Cos>},
    {"cosh", 1, 1, unary<Op::Cosh>},
    {"exp", 1, 1, unary<Op::Exp>},
    {"floor", 1, 1, unary<Op::Floor>},
    {"length", 1, kAny, [](Graph& g, const Arguments& a) { return length(g, a); }},
    {"log", 1, 1, unary<Op::Log>},
    {"log10", 1, 1, [](Graph& g, const Arguments& a) { return ratio(g, Op::Log, a[0], std::numbers::ln10); }},
    {"log2", 1, 1, [](Graph& g, const Arguments& a) { return ratio(g, Op::Log, a[0], std::numbers::ln2); }},
    {"max", 1, kAny, [](Graph& g, const Arguments& a) { return chain(g, Op::Maximum, a); }},
    {"min", 1, kAny, [](Graph& g, const Arguments& a) { return chain(g, Op::Minimum, a); }},
    {"mix", 3, 3, [](Graph& g, const Arguments& a) { return blend(g, a[0], a[1], a[2]); }},
    {"mod", 2, 2, [](Graph& g, const Arguments& a) { return modulo(g, a[0], a[1]); }},
    {"pow", 2, 2, binary<Op::Power>},
    {"sign", 1, 1, unary<Op::Sign>},
    {"sin", 1, 1, unary<Op::Sin>},
    {"sinh", 1, 1, unary<Op::Sinh>},
    {"smoothstep", 3, 3, [](Graph& g, const Arguments& a) { return smoothstep(g, a); }},
    {"sqrt", 1, 1, unary<Op::Sqrt>},
    {"tan", 1, 1, unary<Op::Tan>},
    {"tanh", 1, 1, unary<Op::Tanh>},
};

const Function* find_function(std::string_view name) {
  const auto it =
      std::find_if(std::begin(kFunctions), std::end(kFunctions), [&](const Function& f) { return f.name == name; });
  return it == std::end(kFunctions) ? nullptr : it;
}

struct Variable {
  std::string_view name;
  Op op;
};
constexpr Variable kVariables[] = {{"t", Op::T}, {"x", Op::X}, {"y", Op::Y}, {"z", Op::Z}};  // time first

std::span<const Variable> variables_of(Variables v) { return {kVariables, v == Variables::Time ? 1u : 4u}; }

/// Insertions, deletions, replacements and swaps of neighbours from a to b.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i)
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        d[i][j] = i + j;
        continue;
      }
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  return d[a.size()][b.size()];
}

// ---- grammar
// --------------------------------------------------------------------------------------------------------------

class Parser {
 public:
  Parser(std::string_view text, std::span<const std::string> parameters, Variables variables)
      : text_(text), parameters_(parameters), variables_(variables_of(variables)), graph_(parameters.size()) {}

  Tape parse() {
    if (text_.size() > kLongest) fail(kLongest, "the formula is longer than a million characters");
    const Node root = sum();
    if (at_ < text_.size()) unexpected();
    return graph_.tape(root);
  }

 private:
  [[noreturn]] static void fail(std::size_t at, const std::string& reason) { throw FormulaError(at + 1, reason); }

  char peek() {
    while (at_ < text_.size() && is_space(text_[at_])) ++at_;
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  bool accept(char c) {
    if (peek() != c || at_ == text_.size()) return false;
    ++at_;
    return true;
  }

  [[noreturn]] void unexpected() {
    const char c = peek();
    if (at_ == text_.size()) fail(at_, text_.empty() ? "the formula is empty" : "the formula ends too early");
    if (c == ')') fail(at_, "')' without '('");
    if (c == ',') fail(at_, "',' stands only between a function's arguments; decimals are written with a point");
    if (is_letter(c) || is_digit(c) || c == '(' || c == '.') fail(at_, "an operator such as '*' is missing");
    if (c == '*') fail(at_, "unexpected '*' (powers are written '^')");
    if (c > ' ' && c < 127) fail(at_, "unexpected " + quoted({&c, 1}));
    fail(at_, "unexpected character");
  }

  Node sum() {
    Node left = product();
    for (;;) {
      if (accept('+'))
        left = graph_.apply(Op::Add, left, product());
      else if (accept('-'))
        left = graph_.apply(Op::Subtract, left, product());
      else
        return left;
    }
  }

  Node product() {
    Node left = signed_power();
    for (;;) {
      if (accept('*'))
        left = graph_.apply(Op::Multiply, left, signed_power());
      else if (accept('/'))
        left = graph_.apply(Op::Divide, left, signed_power());
      else
        return left;
    }
  }

  /// All recursion passes through here.
  Node signed_power() {
    if (++depth_ > kDeepest) fail(at_, "nested deeper than " + std::to_string(kDeepest));
    Node result;
    if (accept('-')) {
      result = graph_.apply(Op::Negate, signed_power());
    } else if (accept('+')) {
      result = signed_power();
    } else {
      result = atom();
      if (accept('^')) result = graph_.apply(Op::Power, result, signed_power());
    }
    --depth_;
    return result;
  }

  Node atom() {
    const char c = peek();
    if (is_digit(c) || c == '.') return number();
    if (is_letter(c)) return name();
    if (!accept('(')) unexpected();
    const std::size_t open = at_ - 1;
    const Node inner = sum();
    close(open);
    return inner;
  }

  void close(std::size_t open) {
    if (accept(')')) return;
    if (at_ == text_.size()) fail(open, "'(' is never closed");
    unexpected();
  }

  Node number() {
    double value = 0;
    const auto [end, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
    if (error == std::errc::result_out_of_range) fail(at_, "number out of range");
    if (error != std::errc()) fail(at_, "'.' without digits");
    at_ = static_cast<std::size_t>(end - text_.data());
    return graph_.constant(value);
  }

  Node name() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && (is_letter(text_[at_]) || is_digit(text_[at_]))) ++at_;
    const std::string_view word = text_.substr(begin, at_ - begin);
    if (const Function* f = find_function(word)) return call(*f, begin);
    const Node value = named_value(word, begin);
    if (peek() == '(') fail(begin, quoted(word) + " is not a function");
    return value;
  }

  Node named_value(std::string_view word, std::size_t begin) {
    for (const Variable& v : variables_)
      if (v.name == word) return graph_.variable(v.op);
    if (word == "pi") return graph_.constant(std::numbers::pi);
    if (word == "e") return graph_.constant(std::numbers::e);
    for (std::size_t i = 0; i < parameters_.size(); ++i)
      if (parameters_[i] == word) return graph_.parameter(static_cast<std::uint32_t>(i));
    unknown(word, begin);
  }

  Node call(const Function& f, std::size_t begin) {
    const std::string title = quoted(f.name);
    if (!accept('(')) fail(begin, title + " is a function: write " + std::string(f.name) + "(…)");
    const std::size_t open = at_ - 1;
    Arguments arguments;
    if (peek() != ')') do
        arguments.push_back(sum());
      while (accept(','));
    close(open);
    if (arguments.size() < f.least || arguments.size() > f.most)
      fail(begin, title + " takes " + (f.most == kAny ? "at least " : "") + std::to_string(f.least) +
                      (f.least == 1 ? " argument, not " : " arguments, not ") + std::to_string(arguments.size()));
    return f.build(graph_, arguments);
  }

  [[noreturn]] void unknown(std::string_view word, std::size_t begin) {
    std::vector<std::string_view> candidates;
    for (const Variable& v : variables_) candidates.push_back(v.name);
    for (const std::string& p : parameters_) candidates.push_back(p);
    for (const Function& f : kFunctions) candidates.push_back(f.name);
    candidates.push_back("pi");
    std::string message = "unknown name " + quoted(word);
    std::size_t best = std::min<std::size_t>(3, word.size());  // one letter is not a hint
    std::string_view likely;
    for (const std::string_view c : candidates) {
      const std::size_t d = word.size() > 40 ? best : edit_distance(word, c);
      if (d < best) {
        best = d;
        likely = c;
      }
    }
    if (!likely.empty()) message.append("; did you mean ").append(quoted(likely)).append("?");
    fail(begin, message);
  }

  std::string_view text_;
  std::span<const std::string> parameters_;
  std::span<const Variable> variables_;
  Graph graph_;
  std::size_t at_ = 0;
  int depth_ = 0;
};

void check_parameters(std::span<const std::string> parameters) {
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const std::string& name = parameters[i];
    const auto letters = [](char c) { return is_letter(c) || is_digit(c); };
    if (name.empty() || is_digit(name[0]) || !std::all_of(name.begin(), name.end(), letters))
      throw InvalidInput("parameter name " + quoted(name) + " is not made of letters, digits and '_'");
    const bool variable =
        std::any_of(std::begin(kVariables), std::end(kVariables), [&](const Variable& v) { return v.name == name; });
    if (variable || name == "pi" || name == "e" || find_function(name))
      throw InvalidInput("parameter name " + quoted(name) + " already means something in formulas");
    if (std::find(parameters.begin(), parameters.begin() + static_cast<std::ptrdiff_t>(i), name) !=
        parameters.begin() + static_cast<std::ptrdiff_t>(i))
      throw InvalidInput("parameter " + quoted(name) + " is given twice");
  }
}

}  // namespace

FormulaError::FormulaError(std::size_t column, const std::string& reason)
    : InvalidInput("formula, column " + std::to_string(column) + ": " + reason), column_(column) {}

Tape parse_formula(std::string_view text, std::span<const std::string> parameters, Variables variables) {
  check_parameters(parameters);
  return Parser(text, parameters, variables).parse();
}

}  // namespace meniscus::field
