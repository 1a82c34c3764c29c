#include <meniscus/field/curve.h>

#include <meniscus/base/error.h>
#include <meniscus/field/time_expression.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace meniscus::field {
namespace {

TEST(Curve, PassesThroughItsKeysAndIsFlatOutside) {
  for (const auto how : {CurveInterpolation::Step, CurveInterpolation::Linear, CurveInterpolation::Cubic}) {
    const Curve curve({-1, 0, 2, 2.5}, {3, 5, 4, 4}, how);
    EXPECT_EQ(curve.at(-1).value, 3);
    EXPECT_EQ(curve.at(0).value, 5);
    EXPECT_EQ(curve.at(2).value, 4);
    EXPECT_EQ(curve.at(2.5).value, 4);
    EXPECT_EQ(curve.at(-7).value, 3);
    EXPECT_EQ(curve.at(1e30).value, 4);
    EXPECT_EQ(curve.at(-7).rate, 0);
    EXPECT_EQ(curve.at(3).rate, 0);
    EXPECT_TRUE(std::isnan(curve.at(std::nan("")).value));
  }
}

TEST(Curve, StepsAndLines) {
  const Curve step({0, 1}, {2, 6}, CurveInterpolation::Step), line({0, 2}, {2, 6}, CurveInterpolation::Linear);
  EXPECT_EQ(step.at(0.999).value, 2);
  EXPECT_EQ(step.at(1).value, 6);
  EXPECT_EQ(step.at(0.5).rate, 0);
  EXPECT_EQ(line.at(0.5).value, 3);
  EXPECT_EQ(line.at(0).rate, 2);
  EXPECT_EQ(line.at(1.9).rate, 2);
}

TEST(Curve, CubicRatesAreExactAndContinuous) {
  const Curve curve({0, 1, 1.5, 4, 5}, {0, 1, 3, 3.5, -1});
  const double h = 1e-5;
  for (double t = -0.5; t < 5.5; t += 0.0371)
    EXPECT_NEAR(curve.at(t).rate, (curve.at(t + h).value - curve.at(t - h).value) / (2 * h), 1e-4) << t;
  for (const double key : {0.0, 1.0, 1.5, 4.0, 5.0})
    EXPECT_NEAR(curve.at(key - 1e-9).rate, curve.at(key + 1e-9).rate, 1e-6) << key;
}

TEST(Curve, CubicNeverOvershoots) {
  const std::vector<double> times{0, 1, 1.1, 3, 3.2, 9}, values{0, 0, 10, 10.5, -4, -4};
  const Curve curve(times, values);
  for (std::size_t i = 0; i + 1 < times.size(); ++i)
    for (int k = 0; k <= 100; ++k) {
      const double v = curve.at(times[i] + (times[i + 1] - times[i]) * k / 100.0).value;
      EXPECT_GE(v, std::min(values[i], values[i + 1]) - 1e-12);
      EXPECT_LE(v, std::max(values[i], values[i + 1]) + 1e-12);
    }
}

TEST(Curve, CubicFollowsAStraightLineOfKeysInTheMiddle) {
  const Curve curve({0, 1, 2, 3, 4}, {0, 2, 4, 6, 8});
  EXPECT_NEAR(curve.at(1.3).value, 2.6, 1e-12);
  EXPECT_NEAR(curve.at(2.8).rate, 2, 1e-12);
}

TEST(Curve, OneKeyIsAConstant) {
  const Curve curve({2}, {7});
  for (const double t : {-1.0, 2.0, 3.0}) {
    EXPECT_EQ(curve.at(t).value, 7);
    EXPECT_EQ(curve.at(t).rate, 0);
  }
}

TEST(Curve, RejectsKeysWithoutMeaning) {
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_THROW(Curve({}, {}), InvalidInput);
  EXPECT_THROW(Curve({0, 1}, {0}), InvalidInput);
  EXPECT_THROW(Curve({0, 0}, {0, 1}), InvalidInput);
  EXPECT_THROW(Curve({1, 0}, {0, 1}), InvalidInput);
  EXPECT_THROW(Curve({0, std::nan("")}, {0, 1}), InvalidInput);
  EXPECT_THROW(Curve({0, inf}, {0, 1}), InvalidInput);
  EXPECT_THROW(Curve({0, 1}, {0, -inf}), InvalidInput);
}

TEST(TimeExpression, HasTheExactRate) {
  const TimeExpression f("0.5 + 0.1*sin(2*pi*t)");
  const double w = 2 * std::acos(-1.0);
  for (const double t : {0.0, 0.13, 2.7, -4.1}) {
    EXPECT_NEAR(f.at(t).value, 0.5 + 0.1 * std::sin(w * t), 1e-15);
    EXPECT_NEAR(f.at(t).rate, 0.1 * w * std::cos(w * t), 1e-14);
  }
  EXPECT_EQ(TimeExpression("3").at(1).value, 3);
  EXPECT_EQ(TimeExpression("3").at(1).rate, 0);
  EXPECT_TRUE(std::isnan(TimeExpression("sqrt(t)").at(-1).value));
  EXPECT_EQ(TimeExpression("sqrt(t)").at(0).rate, 0);
  EXPECT_THROW(TimeExpression("x + t"), InvalidInput);
}

}  // namespace
}  // namespace meniscus::field
