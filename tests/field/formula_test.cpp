#include <meniscus/field/formula.h>

#include <meniscus/field/tape_run.h>

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace meniscus::field {
namespace {

/// The value of a formula at (x, y, z) = (0.5, -2, 3), t = 0.25, with a = 4 and b = -1.
double value_of(const std::string& text) {
  const std::vector<std::string> names{"a", "b"};
  const double values[] = {4, -1}, x = 0.5, y = -2, z = 3, seeds[8] = {};
  double f = 0;
  run_tape(parse_formula(text, names), {values, seeds, 0.25, true, false}, {&x, &y, &z, 1}, {&f, 1, 1, Order::Value});
  return f;
}

TEST(Formula, FollowsTheRulesOfPrecedence) {
  EXPECT_EQ(value_of("1 + 2*3"), 7);
  EXPECT_EQ(value_of("(1 + 2)*3"), 9);
  EXPECT_EQ(value_of("-2^2"), -4);
  EXPECT_EQ(value_of("2^3^2"), 512);
  EXPECT_EQ(value_of("2^-1"), 0.5);
  EXPECT_EQ(value_of("8/4/2"), 1);
  EXPECT_EQ(value_of("8-4-2"), 2);
  EXPECT_EQ(value_of("2*-x"), -1);
  EXPECT_EQ(value_of("--x"), 0.5);
  EXPECT_EQ(value_of("+x - -y"), -1.5);
  EXPECT_EQ(value_of("-x^2"), -0.25);
  EXPECT_EQ(value_of("a*x + b"), 1);
  EXPECT_EQ(value_of(" \t x\n*\r\n z"), 1.5);
}

TEST(Formula, ReadsNumbersAndConstants) {
  EXPECT_EQ(value_of(".5"), 0.5);
  EXPECT_EQ(value_of("1e3"), 1000);
  EXPECT_EQ(value_of("2.5E-2"), 0.025);
  EXPECT_EQ(value_of("pi"), std::numbers::pi);
  EXPECT_EQ(value_of("e"), std::numbers::e);
  EXPECT_EQ(value_of("2*e"), 2 * std::numbers::e);
  EXPECT_EQ(value_of("t"), 0.25);
}

TEST(Formula, KnowsItsFunctions) {
  const double x = 0.5, y = -2, z = 3;
  const auto expect = [](const std::string& text, double value) {
    EXPECT_NEAR(value_of(text), value, 1e-15 * (1 + std::abs(value))) << text;
  };
  expect("sin(x)", std::sin(x));
  expect("cos(z)", std::cos(z));
  expect("tan(y)", std::tan(y));
  expect("asin(x)", std::asin(x));
  expect("acos(x)", std::acos(x));
  expect("atan(y)", std::atan(y));
  expect("atan2(y, x)", std::atan2(y, x));
  expect("sinh(x)", std::sinh(x));
  expect("cosh(y)", std::cosh(y));
  expect("tanh(x)", std::tanh(x));
  expect("exp(y)", std::exp(y));
  expect("log(z)", std::log(z));
  expect("log2(a)", 2);
  expect("log10(z)", std::log10(z));
  expect("sqrt(z)", std::sqrt(z));
  expect("abs(y)", 2);
  expect("sign(y)", -1);
  expect("floor(x*y - 0.1)", -2);
  expect("ceil(x)", 1);
  expect("mod(y, 3)", 1);
  expect("mod(z, x + 1.5)", 1);
  expect("pow(z, x)", std::pow(z, x));
  expect("z^2.5", std::pow(z, 2.5));
  expect("2^x", std::pow(2, x));
  expect("x^-3", 8);
  expect("y^7", -128);
  expect("min(x, y, z)", y);
  expect("max(x, y, z, 3.5)", 3.5);
  expect("length(x, y, z)", std::sqrt(x * x + y * y + z * z));
  expect("clamp(y, 0, 1)", 0);
  expect("clamp(x, 0, 1)", x);
  expect("mix(x, z, 0.25)", x + 0.25 * (z - x));
  expect("smoothstep(0, 1, x)", 0.5);
  expect("smoothstep(0, 2, x)", 3 * 0.0625 - 2 * 0.015625);
}

std::size_t length_of(const std::string& text) { return parse_formula(text, {}).code.size(); }

TEST(Formula, ComputesCommonPartsOnce) {
  EXPECT_EQ(length_of("sin(x) + cos(y)*sin(x)"), 6u);                        // x, sin, y, cos, *, +
  EXPECT_EQ(length_of("(x+y)^2 + (y+x)^2"), 5u);                             // x, y, +, square, +
  EXPECT_EQ(length_of("x*x*(x*x)"), 3u);                                     // x, square, square
  EXPECT_EQ(length_of("sqrt(x^2+y^2+z^2) - 1 + 2*sqrt(x^2+y^2+z^2)"), 12u);  // 3 + 3 + 2, sqrt, -1, *2, +
  std::string nested = "x";                                                  // doubles in length, grows by one operation
  for (int i = 0; i < 12; ++i) nested = "(" + nested + ")*(" + nested + ")";
  EXPECT_EQ(length_of(nested), 13u);
}

TEST(Formula, FoldsConstants) {
  EXPECT_EQ(length_of("2*3 + sin(0)*4 - pi/pi"), 1u);
  EXPECT_EQ(length_of("x + 0"), 1u);
  EXPECT_EQ(length_of("x*1 - 0"), 1u);
  EXPECT_EQ(length_of("x^1"), 1u);
  EXPECT_EQ(length_of("x^0"), 1u);
  EXPECT_EQ(length_of("-(-x)"), 1u);
  EXPECT_EQ(length_of("(2*pi)*x"), 2u);
}

TEST(Formula, WhatIsTheSameAtAllPointsComesFirst) {
  const std::vector<std::string> names{"a"};
  const Tape tape = parse_formula("sin(2*pi*t)*a*x + exp(a)", names);
  EXPECT_EQ(tape.uniform, 6u);  // t, *2pi, sin, a, sin*a, exp
  EXPECT_TRUE(tape.uses_time);
  EXPECT_TRUE(tape.uses_position);
  EXPECT_FALSE(parse_formula("t + 1", {}).uses_position);
}

TEST(Formula, ReusesRegisters) {
  std::string text = "0";
  for (int i = 0; i < 500; ++i) text.append(" + sin(").append(std::to_string(i)).append("*x)");
  EXPECT_LE(parse_formula(text, {}).registers, 4u);
}

struct Mistake {
  std::string text;
  std::size_t column;
  std::string words;
};

TEST(Formula, SaysWhereAndWhatIsWrong) {
  const std::vector<Mistake> mistakes{
      {"", 1, "empty"},
      {"  ", 3, "too early"},
      {"x +", 4, "too early"},
      {"x + * y", 5, "unexpected '*'"},
      {"x ** 2", 4, "'^'"},
      {"2x", 2, "operator"},
      {"x y", 3, "operator"},
      {"(x + 1", 1, "never closed"},
      {"sin(x", 4, "never closed"},
      {"x + 1)", 6, "without '('"},
      {"0,5*x", 2, "point"},
      {"x + sn(y)", 5, "did you mean 'sin'"},
      {"lenght(x, y)", 1, "did you mean 'length'"},
      {"radus*x", 1, "did you mean 'radius'"},
      {"x + qqqqqq", 5, "unknown name 'qqqqqq'"},
      {"sin + 1", 1, "is a function"},
      {"x(2)", 1, "not a function"},
      {"sin(x, y)", 1, "takes 1 argument, not 2"},
      {"atan2(x)", 1, "takes 2 arguments, not 1"},
      {"min()", 1, "at least 1 argument, not 0"},
      {"x # y", 3, "unexpected '#'"},
      {"x + \xCF\x80", 5, "unexpected character"},
      {"1e999", 1, "out of range"},
      {"x + .", 5, "without digits"},
      {"x = 1", 3, "unexpected '='"},
  };
  const std::vector<std::string> names{"radius"};
  for (const Mistake& m : mistakes) {
    try {
      parse_formula(m.text, names);
      ADD_FAILURE() << "accepted: " << m.text;
    } catch (const FormulaError& e) {
      EXPECT_EQ(e.column(), m.column) << m.text << " -> " << e.what();
      EXPECT_NE(std::string(e.what()).find(m.words), std::string::npos) << m.text << " -> " << e.what();
      EXPECT_NE(std::string(e.what()).find("column " + std::to_string(m.column)), std::string::npos);
    }
  }
}

TEST(Formula, OfTimeKnowsNoPlace) {
  EXPECT_NO_THROW(parse_formula("sin(t)", {}, Variables::Time));
  EXPECT_THROW(parse_formula("x*t", {}, Variables::Time), FormulaError);
}

TEST(Formula, RejectsImproperParameterNames) {
  for (const std::string bad : {"", "x", "t", "pi", "sin", "2a", "a-b", "ä"}) {
    const std::vector<std::string> names{bad};
    EXPECT_THROW(parse_formula("1", names), InvalidInput) << bad;
  }
  const std::vector<std::string> twice{"a", "b", "a"};
  EXPECT_THROW(parse_formula("1", twice), InvalidInput);
}

TEST(Formula, HugeAndDeepInputsAreRefusedOrReadNotFatal) {
  EXPECT_THROW(parse_formula(std::string(100'000, '('), {}), FormulaError);
  EXPECT_THROW(parse_formula(std::string(100'000, '-') + "x", {}), FormulaError);
  std::string tower = "x", calls;
  for (int i = 0; i < 20'000; ++i) {
    tower += "^x";
    calls += "sin(";
  }
  EXPECT_THROW(parse_formula(tower, {}), FormulaError);
  EXPECT_THROW(parse_formula(calls, {}), FormulaError);
  EXPECT_THROW(parse_formula(std::string(1'000'001, '1'), {}), FormulaError);
  EXPECT_THROW(parse_formula(std::string(50'000, 'q'), {}), FormulaError);
  std::string sum = "x";
  for (int i = 0; i < 100'000; ++i) sum += i % 2 ? "+x*y" : "-y";
  EXPECT_NO_THROW(parse_formula(sum, {}));
  std::string nested = "x";
  for (int i = 0; i < 150; ++i) nested = "(" + nested + ")";
  EXPECT_NO_THROW(parse_formula(nested, {}));
}

TEST(Formula, RandomTextNeverDoesHarm) {
  const std::vector<std::string> pieces{"x",    "y",           "z",      "t",     "a",    "(",      ")",      "+",    "-",
                                        "*",    "/",           "^",      ",",     "1",    "2.5e-3", " ",      "sin(", "min(",
                                        "pow(", "smoothstep(", "clamp(", "1e308", "0",    "abs",    "atan2(", ".",    "e",
                                        "pi",   "\x80",        "#",      "mod(",  "log(", "sqrt("};
  std::mt19937 random(11);
  std::uniform_int_distribution<std::size_t> pick(0, pieces.size() - 1), length(1, 14);
  const std::vector<std::string> names{"a"};
  const double values[] = {0.5}, seeds[4] = {0, 0, 0, 1};
  const double x[] = {0.3, -1e30, 1e300}, y[] = {0, 2, -3}, z[] = {-0.7, 0, 5};
  int accepted = 0;
  for (int n = 0; n < 100'000; ++n) {
    std::string text;
    for (std::size_t k = length(random); k-- > 0;) text += pieces[pick(random)];
    try {
      const Tape tape = parse_formula(text, names);
      double rows[3 * row_count(Order::HessianTime)];
      const TapeState state{values, seeds, 0.1, true, true};
      run_tape(tape, state, {x, y, z, 3}, {rows, 3, 3, Order::HessianTime});
      const Interval range = range_of_tape(tape, state, {Interval(0.2, 0.4), Interval(-1, 0.5), Interval(-0.8, -0.6)});
      if (!std::isnan(rows[0])) EXPECT_TRUE(range.contains(rows[0])) << text;
      for (std::size_t r = 1; r < row_count(Order::HessianTime); ++r)
        for (std::size_t i = 0; i < 3; ++i)
          EXPECT_TRUE(!std::isfinite(rows[i]) || std::isfinite(rows[3 * r + i])) << text << " row " << r << " point " << i;
      ++accepted;
    } catch (const FormulaError& e) {
      EXPECT_GE(e.column(), 1u);
      EXPECT_LE(e.column(), text.size() + 1);
    }
  }
  EXPECT_GT(accepted, 1000);
}

}  // namespace
}  // namespace meniscus::field
