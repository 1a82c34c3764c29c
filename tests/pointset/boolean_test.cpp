#include <meniscus/base/error.h>
#include <meniscus/pointset/boolean.h>
#include <meniscus/pointset/local_fit.h>
#include <meniscus/pointset/point_set_field.h>

#include "shapes.h"

#include <gtest/gtest.h>

namespace meniscus::pointset {
namespace {

constexpr Operation kAll[] = {Operation::Union, Operation::Intersection, Operation::Difference};

Solid leaf(const points::Cloud& cloud) {
  Solid s;
  if (!cloud.empty()) s.set = fit(cloud);
  return s;
}

Solid node(Operation operation, const Solid& a, const Solid& b) {
  Solid s;
  s.operation = operation;
  s.inputs = {a, b};
  return s;
}

points::Cloud ball(double x, std::size_t n = 4000) { return shapes::sphere(n, 1, {x, 0, 0}); }

std::vector<std::int64_t> parts(const points::Cloud& c) {
  const auto p = c.attributes.integers("part");
  return {p.begin(), p.end()};
}

/// Two unit balls a distance of 1 apart: they meet in a circle of radius √3/2 in the plane x = 1/2.
TEST(Boolean, PointsAreThoseOfTheTableAndEdgesLieOnTheTrueCurve) {
  const points::Cloud a = ball(0), b = ball(1);
  const double spacing = std::sqrt(4 * shapes::kPi / 4000);
  for (const Operation operation : kAll) {
    BooleanReport report;
    const points::Cloud result = points_of(node(operation, leaf(a), leaf(b)), &report);
    const auto part = parts(result);
    const auto n = result.attributes.values("N", 3), na = result.attributes.values("N_a", 3),
               nb = result.attributes.values("N_b", 3);
    ASSERT_EQ(part.size(), result.size());
    std::size_t counts[3] = {};
    const double turn = operation == Operation::Difference ? -1 : 1;
    std::vector<double> angles;
    for (std::size_t i = 0; i < result.size(); ++i) {
      ++counts[part[i]];
      const Vec3 p = result.positions[i], from_b = p - Vec3(1, 0, 0);
      const auto normal = [&](std::span<const double> v) { return Vec3(v[3 * i], v[3 * i + 1], v[3 * i + 2]); };
      if (part[i] == 0) {
        EXPECT_EQ(from_b.norm() > 1, operation != Operation::Intersection);
        EXPECT_LT((normal(n) - p).norm(), 1e-9);
      } else if (part[i] == 1) {
        EXPECT_EQ(p.norm() > 1, operation == Operation::Union);
        EXPECT_LT((normal(n) - turn * from_b).norm(), 1e-9);
      } else {
        EXPECT_LT(std::hypot(p.x() - 0.5, std::hypot(p.y(), p.z()) - std::sqrt(0.75)), 0.05 * spacing);
        EXPECT_LT((normal(na) - p).norm(), 0.01);
        EXPECT_LT((normal(nb) - turn * from_b).norm(), 0.01);
        angles.push_back(std::atan2(p.z(), p.y()));
      }
    }
    EXPECT_EQ(report.kept_a, counts[0]);
    EXPECT_EQ(report.kept_b, counts[1]);
    EXPECT_EQ(report.edge_points, counts[2]);
    // All around, about a spacing apart.
    std::sort(angles.begin(), angles.end());
    ASSERT_GT(angles.size(), 30u);
    angles.push_back(angles.front() + 2 * shapes::kPi);
    for (std::size_t k = 1; k < angles.size(); ++k)
      EXPECT_LT(std::sqrt(0.75) * (angles[k] - angles[k - 1]), 2.2 * spacing) << static_cast<int>(operation);
  }
}

TEST(Boolean, FieldIsSharpAndKnowsInsideFromOutside) {
  const Solid a = leaf(ball(0)), b = leaf(ball(1));
  for (const Operation operation : kAll) {
    const auto field = field_of(node(operation, a, b));
    for (std::size_t i = 0; i < 400; ++i) {
      const Vec3 p =
          1.7 * Vec3(2 * shapes::even(i).x() - 0.7, 2 * shapes::even(i).y() - 1, std::sin(0.7 * static_cast<double>(i)));
      const double sa = p.norm() - 1, sb = (p - Vec3(1, 0, 0)).norm() - 1;
      const double s = operation == Operation::Union          ? std::min(sa, sb)
                       : operation == Operation::Intersection ? std::max(sa, sb)
                                                              : std::max(sa, -sb);
      if (std::abs(s) > 0.02) EXPECT_EQ(field::value_at(*field, p) < 0, s < 0) << p.transpose();
    }
    // On the edge the slope jumps from one side's to the other's.
    const Vec3 edge(0.5, std::sqrt(0.75), 0),
        across = operation == Operation::Difference ? Vec3(0, 1e-3, 0) : Vec3(1e-3, 0, 0);
    const auto jets = field::evaluate(*field, {edge + across, edge - across}, field::Order::Gradient);
    EXPECT_GT((jets.gradient(0) - jets.gradient(1)).norm(), 0.9);
  }
}

TEST(Boolean, DisjointSolids) {
  const points::Cloud a = ball(0, 500), b = ball(5, 300);
  BooleanReport r;
  EXPECT_EQ(points_of(node(Operation::Union, leaf(a), leaf(b)), &r).size(), 800u);
  EXPECT_EQ(r.edge_points, 0u);
  EXPECT_TRUE(points_of(node(Operation::Intersection, leaf(a), leaf(b))).empty());
  EXPECT_EQ(points_of(node(Operation::Difference, leaf(a), leaf(b))).positions, a.positions);
}

TEST(Boolean, IdenticalSolids) {
  const points::Cloud a = ball(0, 500);
  EXPECT_EQ(points_of(node(Operation::Union, leaf(a), leaf(a))).positions, a.positions);
  EXPECT_EQ(points_of(node(Operation::Intersection, leaf(a), leaf(a))).positions, a.positions);
  EXPECT_TRUE(points_of(node(Operation::Difference, leaf(a), leaf(a))).empty());
}

TEST(Boolean, OneInsideTheOther) {
  const points::Cloud a = ball(0, 1500), b = shapes::sphere(300, 0.4);
  EXPECT_EQ(points_of(node(Operation::Union, leaf(a), leaf(b))).positions, a.positions);
  EXPECT_EQ(points_of(node(Operation::Intersection, leaf(a), leaf(b))).positions, b.positions);
  EXPECT_EQ(points_of(node(Operation::Difference, leaf(a), leaf(b))).size(), 1800u);  // a shell
  EXPECT_TRUE(points_of(node(Operation::Difference, leaf(b), leaf(a))).empty());
}

TEST(Boolean, EmptySolidsAreNothing) {
  const points::Cloud a = ball(0, 500);
  EXPECT_EQ(points_of(node(Operation::Union, leaf(a), Solid{})).size(), 500u);
  EXPECT_TRUE(points_of(node(Operation::Intersection, leaf(a), Solid{})).empty());
  EXPECT_TRUE(field_of(Solid{})->bounds().empty());
}

TEST(Boolean, Nests) {
  // (ball ∪ ball) less a ball in the middle of their edge, all sharp.
  const Solid two = node(Operation::Union, leaf(ball(0, 2000)), leaf(ball(1, 2000)));
  const Solid bite = leaf(shapes::sphere(1000, 0.5, {0.5, 0.9, 0}));
  const Solid solid = node(Operation::Difference, two, bite);
  BooleanReport r;
  const points::Cloud result = points_of(solid, &r);
  EXPECT_GT(r.edge_points, 20u);
  const auto field = field_of(solid);
  const auto values = field::evaluate(*field, result.positions, field::Order::Value);
  for (std::size_t i = 0; i < result.size(); ++i) EXPECT_NEAR(values.value(i), 0, 2e-3);
  EXPECT_GT(field::value_at(*field, {0.5, 0.8, 0}), 0);
  EXPECT_LT(field::value_at(*field, {0.5, 0, 0}), 0);
  // As deep as anyone may go, and no deeper.
  Solid deep = leaf(ball(0, 20));
  for (int i = 0; i < kMostNesting; ++i) deep = node(Operation::Union, deep, Solid{});
  EXPECT_NO_THROW(field_of(deep));
  EXPECT_THROW(field_of(node(Operation::Union, deep, Solid{})), InvalidInput);
}

TEST(Boolean, CarriesWhatBothHave) {
  points::Cloud a = ball(0, 400), b = ball(1, 400);
  a.attributes.set_integers("id", 1, std::vector<std::int64_t>(400, 1));
  b.attributes.set_integers("id", 1, std::vector<std::int64_t>(400, 2));
  a.attributes.set("only", 1, std::vector<double>(400, 1));
  const points::Cloud result = points_of(node(Operation::Union, leaf(a), leaf(b)));
  const auto part = parts(result);
  const auto id = result.attributes.integers("id");
  ASSERT_EQ(id.size(), result.size());
  for (std::size_t i = 0; i < id.size(); ++i) EXPECT_EQ(id[i], part[i] == 1 ? 2 : 1);
  EXPECT_FALSE(result.attributes.has("only"));
}

TEST(Boolean, SameAtAnyScaleAndForAnyThreads) {
  const auto run = [](double scale, int threads) {
    RunOptions options;
    options.threads = threads;
    return points_of(node(Operation::Difference, leaf(shapes::transformed(ball(0, 1000), scale)),
                          leaf(shapes::transformed(ball(1, 1000), scale))),
                     nullptr, RunControl(options));
  };
  const points::Cloud one = run(1, 1);
  for (const int threads : {2, 3, 5, 8}) {
    const points::Cloud other = run(1, threads);
    EXPECT_EQ(one.positions, other.positions);
    EXPECT_EQ(parts(one), parts(other));
  }
  for (const double scale : {0.01, 1000.0}) {
    const points::Cloud other = run(scale, 2);
    ASSERT_EQ(parts(one), parts(other));
    for (std::size_t i = 0; i < one.size(); ++i)
      EXPECT_LT((other.positions[i] - scale * one.positions[i]).norm(), 1e-9 * scale);
  }
}

}  // namespace
}  // namespace meniscus::pointset
