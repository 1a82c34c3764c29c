#pragma once

// What every field must do. A new type adds one line to conformance_test.cpp.
#include <meniscus/base/random.h>
#include <meniscus/field/field.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <string>

namespace meniscus::field::conformance {

/// x(t) = a + b sin(t): an animated number with an exact rate.
class Sway final : public TimeFunction {
 public:
  Sway(double a, double b) : a_(a), b_(b) {}
  Sample at(double t) const override { return {a_ + b_ * std::sin(t), b_ * std::cos(t)}; }

 private:
  double a_, b_;
};

inline Number sway(double a, double b) { return Number::animated(std::make_shared<Sway>(a, b)); }

struct Case {
  std::string name;
  std::function<std::unique_ptr<Field>()> make;
  double size = 2;     ///< points are drawn from the cube of this half-width about the origin
  bool smooth = true;  ///< twice differentiable almost everywhere, with derivatives that finite differences can check
};

inline Vec3 random_point(std::uint64_t id, double size) {
  const auto u = random_uniform(7, id, 0);
  return size * Vec3(2 * u[0] - 1, 2 * u[1] - 1, 2 * u[2] - 1);
}

inline double at(const Field& f, const Vec3& p) { return value_at(f, p); }

/// A derivative of g at 0 by Richardson's scheme, and how far two step sizes disagree.
struct Difference {
  double value;
  double doubt;
};

inline Difference difference(const std::function<double(double)>& g, double h) {
  const auto central = [&](double s) { return (g(s) - g(-s)) / (2 * s); };
  const auto fourth = [&](double s) { return (4 * central(s / 2) - central(s)) / 3; };
  // A kink at the very point leaves central differences in agreement; the jump of the slope shows it.
  const auto jump = [&](double s) { return (g(s) - 2 * g(0) + g(-s)) / s; };
  const double a = fourth(h), b = fourth(h / 2);
  return {b, std::abs(a - b) + std::abs(2 * jump(h / 4) - jump(h / 2))};
}

/// Compares a derivative with differences of the quantity it is the derivative of. Points where differences themselves do
/// not settle (seams) are not judged, but they must be few.
class Judge {
 public:
  Judge(std::string what, double scale) : what_(std::move(what)), scale_(scale) {}
  ~Judge() {
    EXPECT_GT(judged_, 0) << what_;
    EXPECT_LE(doubtful_, judged_ / 2) << what_ << ": too many points could not be judged";
  }
  void compare(double exact, const Difference& d, const Vec3& p) {
    ASSERT_TRUE(std::isfinite(exact)) << what_ << " at " << p.transpose();
    const double tolerance = 2e-6 * (scale_ + std::abs(exact));
    if (d.doubt > 0.2 * tolerance) {
      ++doubtful_;
      return;
    }
    ++judged_;
    EXPECT_NEAR(exact, d.value, tolerance) << what_ << " at " << p.transpose();
  }

 private:
  std::string what_;
  double scale_;
  int judged_ = 0, doubtful_ = 0;
};

inline constexpr const char* kRowNames[] = {"F",    "F_x",  "F_y",  "F_z",  "F_t",  "F_xx", "F_xy",
                                            "F_xz", "F_yy", "F_yz", "F_zz", "F_xt", "F_yt", "F_zt"};

inline void derivatives_match_differences(const Case& c) {
  if (!c.smooth) return;
  const auto field = c.make();
  const double t = 0.4, h = 1e-3 * c.size;
  field->set_time(t);
  const auto later = [&](double s) {
    auto f = field->clone();
    f->set_time(t + s);
    return f;
  };
  std::vector<Judge> judges;
  judges.reserve(14);
  for (unsigned r = 0; r < 14; ++r)
    judges.emplace_back(c.name + " " + kRowNames[r], r <= kFzz && r >= kFxx ? 1 / c.size : 1);
  for (std::uint64_t i = 0; i < 60; ++i) {
    const Vec3 p = random_point(i, c.size);
    const auto jets = meniscus::field::evaluate(*field, {p}, Order::HessianTime);
    judges[kF].compare(jets.value(0), {at(*field, p), 0}, p);
    const auto gradient_at = [&](const Field& f, const Vec3& x) {
      return meniscus::field::evaluate(f, {x}, Order::Gradient).gradient(0);
    };
    for (int a = 0; a < 3; ++a) {
      const Vec3 e = Vec3::Unit(a);
      judges[static_cast<std::size_t>(kFx + a)].compare(jets.gradient(0)[a],
                                                        difference([&](double s) { return at(*field, p + s * e); }, h), p);
      for (int b = 0; b <= a; ++b) {
        const int row[3][3] = {{kFxx, kFxy, kFxz}, {kFxy, kFyy, kFyz}, {kFxz, kFyz, kFzz}};
        judges[static_cast<std::size_t>(row[a][b])].compare(
            jets.hessian(0)(a, b), difference([&](double s) { return gradient_at(*field, p + s * e)[b]; }, h), p);
      }
      judges[static_cast<std::size_t>(kFxt + a)].compare(
          jets.gradient_time(0)[a], difference([&](double s) { return gradient_at(*later(s), p)[a]; }, 1e-3), p);
    }
    judges[kFt].compare(jets.time(0), difference([&](double s) { return at(*later(s), p); }, 1e-3), p);
  }
}

/// The orders agree where they overlap, to the last bit.
inline void orders_agree(const Case& c) {
  const auto field = c.make();
  for (std::uint64_t i = 0; i < 40; ++i) {
    const std::vector<Vec3> p{random_point(i, c.size)};
    const auto full = meniscus::field::evaluate(*field, p, Order::HessianTime);
    for (const Order o : {Order::Value, Order::Gradient, Order::GradientTime, Order::Hessian}) {
      const auto part = meniscus::field::evaluate(*field, p, o);
      const double tolerance = 1e-12 * (1 + std::abs(full.value(0)));
      EXPECT_NEAR(part.value(0), full.value(0), tolerance) << c.name;
      if (has_gradient(o))
        EXPECT_LE((part.gradient(0) - full.gradient(0)).norm(), 1e-10 * (1 + full.gradient(0).norm())) << c.name;
      if (has_time(o)) EXPECT_NEAR(part.time(0), full.time(0), 1e-10 * (1 + std::abs(full.time(0)))) << c.name;
      if (has_hessian(o))
        EXPECT_LE((part.hessian(0) - full.hessian(0)).norm(), 1e-8 * (1 + full.hessian(0).norm())) << c.name;
    }
  }
}

/// A batch of any size gives the bits of single points.
inline void batch_equals_single(const Case& c) {
  const auto field = c.make();
  for (const std::size_t n : {std::size_t{0}, std::size_t{1}, std::size_t{3}, std::size_t{257}, std::size_t{10'000}}) {
    std::vector<Vec3> points;
    for (std::size_t i = 0; i < n; ++i) points.push_back(random_point(i, c.size * (i % 5 == 0 ? 30 : 1)));
    const auto batch = meniscus::field::evaluate(*field, points, Order::HessianTime);
    for (std::size_t i = 0; i < n; i += 1 + n / 50) {
      auto single = meniscus::field::evaluate(*field, {points[i]}, Order::HessianTime);
      auto copy = batch;
      for (std::size_t r = 0; r < 14; ++r)
        ASSERT_EQ(std::memcmp(single.view().row(r), copy.view().row(r) + i, sizeof(double)), 0)
            << c.name << " " << kRowNames[r] << " of point " << i << " among " << n;
    }
  }
}

inline void range_bounds_values(const Case& c) {
  const auto field = c.make();
  for (std::uint64_t i = 0; i < 200; ++i) {
    const auto u = random_uniform(11, i, 0);
    const Box box = Box::around(random_point(i, c.size), c.size * std::pow(10, -3 + 3 * u[0]));
    const Interval range = field->range(box);
    ASSERT_LE(range.lo, range.hi) << c.name;
    for (std::uint64_t k = 0; k < 20; ++k) {
      const auto w = random_uniform(13, i, k);
      const Vec3 p = box.min + box.size().cwiseProduct(Vec3(w[0], w[1], w[2]));
      const double f = at(*field, p);
      EXPECT_TRUE(range.contains(f)) << c.name << ": " << f << " not in [" << range.lo << ", " << range.hi << "]";
    }
  }
}

inline void inside_lies_within_bounds(const Case& c) {
  const auto field = c.make();
  const Box bounds = field->bounds().padded(1e-12 * c.size);
  for (std::uint64_t i = 0; i < 2000; ++i) {
    const Vec3 p = random_point(i, 2 * c.size);
    if (at(*field, p) < 0) EXPECT_TRUE(bounds.contains(p)) << c.name << " at " << p.transpose();
  }
}

/// F_q against differences over every unknown.
inline void parameter_rows_match_differences(const Case& c) {
  const auto field = c.make();
  const std::size_t n = field->parameters().size();
  std::vector<double> q;
  for (const Parameter& p : field->parameters()) q.push_back(p.value);
  if (n == 0) return;
  Judge judge(c.name + " F_q", 1);
  for (std::uint64_t i = 0; i < 20; ++i) {
    const Vec3 p = random_point(i, c.size);
    SparseRows rows;
    field->parameter_rows(PositionBatch(std::vector<Vec3>{p}).view(), rows);
    ASSERT_EQ(rows.size(), 1u) << c.name;
    std::vector<double> dense(n, 0.0);
    for (std::size_t k = rows.begin[0]; k < rows.begin[1]; ++k) {
      ASSERT_LT(rows.index[k], n) << c.name;
      if (k > rows.begin[0]) ASSERT_GT(rows.index[k], rows.index[k - 1]) << c.name;
      dense[rows.index[k]] = rows.value[k];
    }
    for (std::size_t k = 0; k < n; k += 1 + n / 12) {
      const auto changed = [&](double s) {
        auto f = field->clone();
        auto moved = q;
        moved[k] += s;
        f->set_parameters(moved);
        return at(*f, p);
      };
      judge.compare(dense[k], difference(changed, 1e-3), p);
    }
  }
}

/// F_t of a field whose unknowns move at given rates is F_q · rates.
inline void rates_give_time_derivative(const Case& c) {
  const auto field = c.make();
  std::vector<double> q, rates;
  for (const Parameter& p : field->parameters()) {
    q.push_back(p.value);
    rates.push_back(std::cos(static_cast<double>(q.size())));
  }
  if (q.empty()) return;
  field->set_parameters(q);
  const auto still = field->clone();
  field->set_parameters(q, rates);
  for (std::uint64_t i = 0; i < 20; ++i) {
    const Vec3 p = random_point(i, c.size);
    SparseRows rows;
    field->parameter_rows(PositionBatch(std::vector<Vec3>{p}).view(), rows);
    double expected = meniscus::field::evaluate(*still, {p}, Order::GradientTime).time(0);
    double size = std::abs(expected);
    for (std::size_t k = 0; k < rows.index.size(); ++k) {
      expected += rows.value[k] * rates[rows.index[k]];
      size += std::abs(rows.value[k]);
    }
    EXPECT_NEAR(meniscus::field::evaluate(*field, {p}, Order::GradientTime).time(0), expected, 1e-9 * (1 + size)) << c.name;
  }
}

/// Points that are not finite give NaN and spoil no neighbour; far points give numbers, not traps.
inline void survives_nasty_points(const Case& c) {
  const auto field = c.make();
  const double inf = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  const Vec3 good = random_point(3, c.size);
  const std::vector<Vec3> points{good,           {nan, 0, 0},    {0, inf, 0}, {0, 0, -inf},      {1e30, 0, 0},
                                 {0, -1e150, 1}, {5e-324, 0, 0}, good,        {1e30, 1e30, 1e30}};
  const auto jets = meniscus::field::evaluate(*field, points, Order::HessianTime);
  for (const std::size_t i : {1u, 2u, 3u}) EXPECT_TRUE(std::isnan(jets.value(i))) << c.name << " point " << i;
  const auto alone = meniscus::field::evaluate(*field, {good}, Order::HessianTime);
  for (const std::size_t i : {0u, 7u}) {
    EXPECT_EQ(jets.value(i), alone.value(0)) << c.name;
    EXPECT_TRUE(jets.gradient(i).allFinite() && jets.hessian(i).allFinite()) << c.name;
  }
  std::vector<double> v(3 * points.size());
  field->material_velocity(PositionBatch(points).view(), {v.data(), v.data() + points.size(), v.data() + 2 * points.size()});
  EXPECT_TRUE(std::isfinite(v[0])) << c.name;
  SparseRows rows;
  field->parameter_rows(PositionBatch(points).view(), rows);
  EXPECT_EQ(rows.size(), points.size()) << c.name;
}

inline void check(const Case& c) {
  derivatives_match_differences(c);
  orders_agree(c);
  batch_equals_single(c);
  range_bounds_values(c);
  inside_lies_within_bounds(c);
  parameter_rows_match_differences(c);
  rates_give_time_derivative(c);
  survives_nasty_points(c);
}

}  // namespace meniscus::field::conformance
