#include <meniscus/field/expression.h>

#include <meniscus/field/cpu.h>
#include <meniscus/field/expression.kernel.h>
#include <meniscus/field/formula.h>
#include <meniscus/field/time_expression.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <random>

namespace meniscus::field {
namespace {

std::vector<Vec3> random_points(std::size_t count, double half_width, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(-half_width, half_width);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i) points.emplace_back(u(random), u(random), u(random));
  return points;
}

TEST(Expression, KnowsTheSphere) {
  const Expression f("x^2 + y^2 + z^2 - r^2", {{"r", 2.0}});
  const JetBatch jets = evaluate(f, {{1, 2, 3}}, Order::HessianTime);
  EXPECT_EQ(jets.value(0), 10);
  EXPECT_EQ(jets.gradient(0), Vec3(2, 4, 6));
  EXPECT_EQ(jets.hessian(0), Mat3(2 * Mat3::Identity()));
  EXPECT_EQ(jets.time(0), 0);
  SparseRows rows;
  f.parameter_rows(PositionBatch({{1, 2, 3}}).view(), rows);
  ASSERT_EQ(rows.size(), 1u);
  ASSERT_EQ(rows.index.size(), 1u);
  EXPECT_EQ(rows.value[0], -4);
  EXPECT_EQ(f.parameters()[0].name, "r");
}

/// Formulas that between them use every function, and where to look at them (all smooth there).
const std::vector<std::string> kFormulas{
    "sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x)",
    "tan(0.3*x) + atan(y*z) + atan2(y + 3, x - 4)",
    "asin(0.3*x) + acos(0.2*y*z)",
    "sinh(x) + cosh(y*0.5) + tanh(x*z)",
    "exp(-x*x - y)/(2 + z)",
    "log(3 + x + y*z*0.1) + sqrt(5 + x*y) + abs(x + 7)",
    "(4 + x)^y + 2^z + (3 + z)^2.5 + (3 + y)^-2.5",
    "x^3 - y^7*z + (x + 5)^-3 + 1/(y - 4) + 3/(z*z + 1)",
    "min(x, y + 9) + max(z, x*y - 20) + clamp(x*y, -30, 30)",
    "smoothstep(-3, 4, x + 0.3*y) + mix(x, y, z*z) + length(x, y, z + 5)",
    "a*sin(b*x + t) + exp(t*y)*b - x/a + z^t",
    "mod(x, 100) + sign(y + 9)*z + floor(x*0.01)*y + log2(z + 8) + log10(x + 8) + pow(y + 3, x)",
};

std::unique_ptr<Expression> make(const std::string& formula) {
  return std::make_unique<Expression>(
      formula, std::vector<std::pair<std::string, Number>>{
                   {"a", 1.5}, {"b", Number::animated(std::make_shared<TimeExpression>("1 + 0.3*sin(2*t)"))}});
}

TEST(Expression, EveryDerivativeMatchesDifferences) {
  for (const std::string& formula : kFormulas) {
    const auto f = make(formula);
    const double t = 1.3, h = 1e-4;
    f->set_time(t);
    std::vector<Vec3> points = random_points(60, 1.5);
    for (Vec3& p : points) p.z() = 0.2 + std::abs(p.z());
    const JetBatch jets = evaluate(*f, points, Order::HessianTime);
    const auto later = f->clone(), earlier = f->clone();
    later->set_time(t + h);
    earlier->set_time(t - h);
    const JetBatch up = evaluate(*later, points, Order::Gradient), down = evaluate(*earlier, points, Order::Gradient);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double tolerance = 2e-7 * (10 + std::abs(jets.value(i)) + jets.hessian(i).norm());
      EXPECT_NEAR(jets.time(i), (up.value(i) - down.value(i)) / (2 * h), tolerance) << formula;
      EXPECT_LT((jets.gradient_time(i) - (up.gradient(i) - down.gradient(i)) / (2 * h)).norm(), tolerance) << formula;
      for (int a = 0; a < 3; ++a) {
        const JetBatch ahead = evaluate(*f, {points[i] + h * Vec3::Unit(a)}, Order::Gradient);
        const JetBatch behind = evaluate(*f, {points[i] - h * Vec3::Unit(a)}, Order::Gradient);
        EXPECT_NEAR(jets.gradient(i)[a], (ahead.value(0) - behind.value(0)) / (2 * h), tolerance) << formula;
        EXPECT_LT((jets.hessian(i).col(a) - (ahead.gradient(0) - behind.gradient(0)) / (2 * h)).norm(), tolerance)
            << formula;
      }
    }
  }
}

TEST(Expression, ParametersAndTheirRates) {
  Expression f("a*x + b^2*y + c*z*t + a*b",
               {{"a", 2.0}, {"b", Number::named("q", 3)}, {"c", Number::named("q", 3)}, {"unused", 1.0}});
  ASSERT_EQ(f.parameters().size(), 3u);  // a, q, unused
  EXPECT_EQ(f.parameters()[1].name, "q");
  f.set_time(0.5);
  f.set_parameters(std::vector<double>{2, 3, 1}, std::vector<double>{10, 100, 7});
  const Vec3 p(1, -1, 4);
  SparseRows rows;
  f.parameter_rows(PositionBatch({p, p}).view(), rows);
  ASSERT_EQ(rows.size(), 2u);
  ASSERT_EQ(rows.begin[1], 2u) << "the unused one is left out";
  EXPECT_EQ(rows.value[0], p.x() + 3);
  EXPECT_EQ(rows.value[1], 2 * 3 * p.y() + p.z() * 0.5 + 2);
  const JetBatch jets = evaluate(f, {p}, Order::HessianTime);
  EXPECT_DOUBLE_EQ(jets.time(0), 10 * rows.value[0] + 100 * rows.value[1] + 3 * p.z());
  EXPECT_DOUBLE_EQ(jets.gradient_time(0).x(), 10);
  EXPECT_DOUBLE_EQ(jets.gradient_time(0).y(), 600);
  EXPECT_TRUE(f.moving());
}

TEST(Expression, ManyParametersGetTheirOwnDerivatives) {
  std::string formula = "0";
  std::vector<std::pair<std::string, Number>> numbers;
  for (int i = 0; i < 11; ++i) {
    std::string name = "p";
    name += std::to_string(i);
    formula.append(" + ").append(name).append("*x^").append(std::to_string(i));
    numbers.emplace_back(name, 1.0);
  }
  const Expression f(formula, numbers);
  SparseRows rows;
  f.parameter_rows(PositionBatch({{2, 0, 0}}).view(), rows);
  ASSERT_EQ(rows.index.size(), 11u);
  for (std::size_t i = 0; i < 11; ++i) EXPECT_EQ(rows.value[i], std::pow(2, i));
}

TEST(Expression, DerivativesAreFiniteWhereTheValueIs) {
  const std::vector<std::string> nasty{"sqrt(x*x + y*y + z*z)", "length(x, y, z) - 1", "x^0.5 + y",  "x^1.5",
                                       "asin(x + 1)",           "acos(1 - x)",         "abs(x)^0.3", "max(x, y)",
                                       "atan2(y, x)",           "(x*x)^0.25"};
  for (const std::string& formula : nasty) {
    const JetBatch jets = evaluate(*make(formula), {Vec3::Zero()}, Order::HessianTime);
    EXPECT_TRUE(std::isfinite(jets.value(0))) << formula;
    EXPECT_TRUE(jets.gradient(0).allFinite() && jets.hessian(0).allFinite() && std::isfinite(jets.time(0))) << formula;
  }
}

TEST(Expression, TroubleIsVisible) {
  EXPECT_TRUE(std::isnan(value_at(*make("sqrt(x)"), {-1, 0, 0})));
  EXPECT_TRUE(std::isnan(value_at(*make("log(x)"), {-1, 0, 0})));
  EXPECT_TRUE(std::isnan(value_at(*make("x^0.5"), {-1, 0, 0})));
  EXPECT_TRUE(std::isinf(value_at(*make("1/x"), {0, 0, 0})));
  EXPECT_TRUE(std::isinf(value_at(*make("log(x)"), {0, 0, 0})));
  EXPECT_TRUE(std::isnan(value_at(*make("asin(x)"), {1.1, 0, 0})));
}

TEST(Expression, ABatchGivesTheBitsOfSinglePoints) {
  std::mt19937 random(2);
  std::vector<Vec3> points = random_points(300, 2);
  for (std::size_t i = 0; i < points.size(); i += 3)
    points[i] *= std::pow(10.0, static_cast<double>(i % 40) - 10);  // all methods mixed
  points[17] = {std::nan(""), 0, 0};
  points[18] = {HUGE_VAL, 1, 1};
  for (const std::string& formula : kFormulas) {
    const auto f = make(formula);
    f->set_time(0.7);
    for (const Order order : {Order::Value, Order::GradientTime, Order::HessianTime}) {
      JetBatch batch = evaluate(*f, points, order);
      for (std::size_t i = 0; i < points.size(); ++i) {
        JetBatch one = evaluate(*f, {points[i]}, order);
        for (std::size_t r = 0; r < row_count(order); ++r) {
          const double a = batch.view().row(r)[i], b = one.view().row(r)[0];
          ASSERT_TRUE(std::memcmp(&a, &b, sizeof a) == 0 || (std::isnan(a) && std::isnan(b)))
              << formula << " at " << points[i].transpose();
        }
      }
    }
  }
}

TEST(Expression, SameBitsWithAndWithoutAvx2) {
  if (!has_avx2()) GTEST_SKIP();
  std::vector<Vec3> points = random_points(64, 2);
  for (std::size_t i = 0; i < points.size(); i += 3) points[i] *= std::pow(10.0, static_cast<double>(i % 30) - 8);
  const PositionBatch x(points);
  for (const std::string& formula : kFormulas) {
    const std::vector<std::string> names{"a", "b"};
    const Tape tape = parse_formula(formula, names);
    const double values[] = {1.5, 0.9}, seeds[] = {0, 0, 0, 0, 0, 0, 0, 0.3};
    alignas(64) static double scratch[1 << 16];
    const TapeInputs in{&tape, values, seeds, true, 0.7, true, scratch, 4};
    JetBatch narrow(points.size(), Order::HessianTime), wide(points.size(), Order::HessianTime);
    kernel::run_tape<packet::Sse2>(in, x.view(), narrow.view());
    kRunTapeAvx2(in, x.view(), wide.view());
    for (std::size_t r = 0; r < row_count(Order::HessianTime); ++r)
      for (std::size_t i = 0; i < points.size(); ++i) {
        const double a = narrow.view().row(r)[i], b = wide.view().row(r)[i];
        ASSERT_TRUE(a == b || (std::isnan(a) && std::isnan(b)))
            << formula << " row " << r << " at " << points[i].transpose();
      }
  }
}

TEST(Expression, SineAndCosineAreAccurateForEveryArgument) {
  const Expression sine("sin(x)"), cosine("cos(x)");
  std::mt19937 random(4);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int n = 0; n < 20'000; ++n) {
    const double x = u(random) * std::pow(10, 1 + 9 * u(random));
    EXPECT_NEAR(value_at(sine, {x, 0, 0}), std::sin(x), 3e-16) << x;
    EXPECT_NEAR(value_at(cosine, {x, 0, 0}), std::cos(x), 3e-16) << x;
  }
  for (const double x : {1e22, 1e300, -1e30, 5e-324}) EXPECT_EQ(value_at(sine, {x, 0, 0}), std::sin(x));
  for (int k = -1000; k <= 1000; ++k) {
    const double x = k * std::numbers::pi / 2;
    EXPECT_NEAR(value_at(sine, {x, 0, 0}), std::sin(x), 1e-16 + 2e-16 * std::abs(std::sin(x)));
  }
}

TEST(Expression, RangeHoldsAllValues) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(0, 1);
  std::vector<std::string> formulas = kFormulas;
  formulas.insert(formulas.end(), {"1/x", "tan(2*x)", "x^-2*y", "sqrt(x) + log(y)", "atan2(y, x)", "(x - 1)^1.5", "abs(x)^y",
                                   "x^y", "asin(x) + acos(y)", "sin(40*x)*cos(17*y)", "x*y - x*y", "mod(x, y)"});
  for (const std::string& formula : formulas) {
    const auto f = make(formula);
    for (int n = 0; n < 200; ++n) {
      const Vec3 size = Vec3(u(random), u(random), u(random)) * std::pow(10, 1 - 4 * u(random));
      const Vec3 corner = 6 * Vec3(u(random) - 0.5, u(random) - 0.5, u(random) - 0.5);
      const Box box{corner, corner + size};
      const Interval range = f->range(box);
      for (int k = 0; k < 20; ++k) {
        const Vec3 p = k == 0   ? box.min
                       : k == 1 ? box.max
                                : Vec3(corner + Vec3(u(random), u(random), u(random)).cwiseProduct(size));
        const double v = value_at(*f, p);
        if (!std::isnan(v)) {
          ASSERT_TRUE(range.contains(v)) << formula << ": " << v << " not in " << range.lo << " … " << range.hi;
        }
      }
    }
  }
}

TEST(Expression, RangeIsTight) {
  const auto range = [](const std::string& formula, const Box& box) { return make(formula)->range(box); };
  const Box unit{Vec3::Zero(), Vec3::Ones()};
  EXPECT_NEAR(range("x^2 + y^2 + z^2 - 1", unit).lo, -1, 1e-12);
  EXPECT_NEAR(range("x^2 + y^2 + z^2 - 1", unit).hi, 2, 1e-12);
  EXPECT_GE(range("x^2", Box::around(Vec3::Zero(), 1)).lo, -1e-300);
  EXPECT_GT(range("length(x, y, z) - 1", Box::around({2, 0, 0}, 0.1)).lo, 0.8);
  EXPECT_LT(range("sin(x)", unit).hi, 0.85);
  EXPECT_TRUE(range("x", Box::everywhere()).contains_zero());
  EXPECT_TRUE(range("x", {}).contains_zero());
}

TEST(Expression, BoundsAreTheCallersOrEverywhere) {
  EXPECT_FALSE(make("x")->bounds().finite());
  const Expression f("length(x, y, z) - 1", {}, Box::around(Vec3::Zero(), 1));
  EXPECT_EQ(f.bounds().max, Vec3(Vec3::Ones()));
}

TEST(Expression, ConstantAndUniformFormulas) {
  EXPECT_EQ(value_at(*make("3"), {1, 2, 3}), 3);
  const auto f = make("a*t");
  f->set_time(2);
  const JetBatch jets = evaluate(*f, random_points(300, 1), Order::HessianTime);
  for (std::size_t i = 0; i < 300; ++i) {
    EXPECT_EQ(jets.value(i), 3);
    EXPECT_EQ(jets.time(i), 1.5);
    EXPECT_EQ(jets.gradient(i), Vec3(Vec3::Zero()));
  }
  EXPECT_TRUE(f->moving());
  EXPECT_FALSE(Expression("x").moving());
}

}  // namespace
}  // namespace meniscus::field
