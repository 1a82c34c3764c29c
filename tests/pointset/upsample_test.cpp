#include <meniscus/pointset/upsample.h>

#include <meniscus/base/random.h>
#include <meniscus/pointset/local_fit.h>

#include "clouds.h"

#include <gtest/gtest.h>

#include <limits>

namespace meniscus::pointset {
namespace {

Solid leaf(const points::Cloud& cloud) {
  Solid s;
  s.set = fit(cloud);
  return s;
}

constexpr std::size_t kNoLimit = 1U << 30;

points::Cloud upsampled(const Solid& solid, double spacing, std::size_t most = kNoLimit, const RunControl& run = {}) {
  return upsample(
      solid, [&](const Vec3&, const Vec3&) { return spacing; }, most, nullptr, run);
}

Vec3 random_direction(std::uint64_t id) {
  const auto u = random_uniform(3, id, 0);
  const double z = 2 * u[0] - 1, r = std::sqrt(1 - z * z), a = 2 * std::numbers::pi * u[1];
  return {r * std::cos(a), r * std::sin(a), z};
}

/// Of the places those that no disc covers.
std::size_t holes(const points::Cloud& discs, const std::vector<Vec3>& places) {
  const points::NeighbourSearch search(discs.positions);
  const auto radius = discs.attributes.values(attribute::kRadius, 1);
  const auto widest = *std::max_element(radius.begin(), radius.end());
  std::vector<points::Neighbour> near;
  std::size_t holes = 0;
  for (const Vec3& p : places) {
    search.within(p, widest, near);
    const bool covered = std::any_of(near.begin(), near.end(), [&](const points::Neighbour& n) {
      return n.squared_distance <= radius[n.index] * radius[n.index];
    });
    if (!covered) ++holes;
  }
  return holes;
}

std::vector<Vec3> places_on_sphere(double radius, std::size_t count = 20000) {
  std::vector<Vec3> places;
  for (std::uint64_t i = 0; i < count; ++i) places.push_back(radius * random_direction(i));
  return places;
}

TEST(Upsample, CoversASphereWithPointsOnIt) {
  for (const double scale : {0.01, 1.0, 1000.0}) {
    const Solid sphere = leaf(test::sphere(1000, scale));
    const points::Cloud dense = upsampled(sphere, 0.02 * scale);
    EXPECT_GT(dense.size(), 4 * std::numbers::pi / (0.02 * 0.02));
    EXPECT_LT(dense.size(), 1.7 * 4 * std::numbers::pi / (0.02 * 0.02));
    EXPECT_EQ(holes(dense, places_on_sphere(scale)), 0u);
    const auto normals = test::normals_of(dense);
    const auto field = field_of(sphere);
    const auto values = field::evaluate(*field, dense.positions, field::Order::Value);
    for (std::size_t i = 0; i < dense.size(); ++i) {
      ASSERT_LT(std::abs(values.value(i)), 2e-4 * 0.02 * scale);
      ASSERT_NEAR(dense.positions[i].norm(), scale, 1e-4 * scale);
      ASSERT_LT(test::degrees_between(normals[i], dense.positions[i]), 0.2);
    }
    for (const double r : dense.attributes.values(attribute::kRadius, 1)) EXPECT_NEAR(r, 0.016 * scale, 1e-9 * scale);
  }
}

TEST(Upsample, OfATorusHasNoHoleEither) {
  const points::Cloud dense = upsampled(leaf(test::torus(3000, 1, 0.4)), 0.01);
  std::vector<Vec3> places;
  for (std::uint64_t i = 0; i < 20000; ++i) {
    const auto u = random_uniform(9, i, 0);
    const double a = 2 * std::numbers::pi * u[0], b = 2 * std::numbers::pi * u[1], r = 1 + 0.4 * std::cos(b);
    places.emplace_back(r * std::cos(a), r * std::sin(a), 0.4 * std::sin(b));
  }
  EXPECT_EQ(holes(dense, places), 0u);
}

TEST(Upsample, KeepsToTheLimitAndStillHasNoHole) {
  const Solid sphere = leaf(test::sphere(1000));
  UpsampleReport report;
  const auto tiny = [](const Vec3&, const Vec3&) { return 1e-6; };
  const points::Cloud dense = upsample(sphere, tiny, 20000, &report);
  EXPECT_LE(dense.size(), 20000u);
  EXPECT_GT(dense.size(), 10000u);
  EXPECT_GT(report.coarser, 1000);
  EXPECT_EQ(holes(dense, places_on_sphere(1)), 0u);
  upsample(
      sphere, [](const Vec3&, const Vec3&) { return 0.05; }, kNoLimit, &report);
  EXPECT_EQ(report.coarser, 1);
}

TEST(Upsample, IsAsDenseAsWantedWhereItIsWanted) {
  const auto spacing = [](const Vec3& p, const Vec3& n) {
    EXPECT_GT(p.dot(n), 0);
    return p.x() > 0 ? 0.01 : std::numeric_limits<double>::infinity();
  };
  const points::Cloud dense = upsample(leaf(test::sphere(2000)), spacing, kNoLimit);
  const auto right = std::count_if(dense.positions.begin(), dense.positions.end(), [](const Vec3& p) { return p.x() > 0; });
  EXPECT_GT(right, 2 * std::numbers::pi / 1e-4);
  EXPECT_LT(static_cast<long>(dense.size()) - right, right / 2);
  EXPECT_EQ(holes(dense, places_on_sphere(1)), 0u);
}

TEST(Upsample, DoesNotCloseAnOpenSheet) {
  std::vector<std::size_t> upper;
  const points::Cloud whole = test::sphere(4000);
  for (std::size_t i = 0; i < whole.size(); ++i)
    if (whole.positions[i].z() > 0.3) upper.push_back(i);
  const double own = std::sqrt(4 * std::numbers::pi / 4000);
  const points::Cloud dense = upsampled(leaf(points::gathered(whole, upper)), 0.01);
  for (const Vec3& p : dense.positions) {
    ASSERT_GT(p.z(), 0.3 - 1.5 * own);
    ASSERT_NEAR(p.norm(), 1, 1e-3);
  }
  EXPECT_LT(dense.size(), 1.9 * 1.4 * std::numbers::pi / 1e-4) << "samples beyond the border pile up on it";
  std::vector<Vec3> places;
  for (const Vec3& p : places_on_sphere(1))
    if (p.z() > 0.3 + own) places.push_back(p);
  EXPECT_EQ(holes(dense, places), 0u);
}

/// A unit ball less one at a distance of 1: its edge is the circle of radius √3/2 in the plane x = 1/2.
TEST(Upsample, EndsAtTheSharpEdgeOfABoolean) {
  Solid solid;
  solid.operation = Operation::Difference;
  solid.inputs = {leaf(test::sphere(3000)), leaf(test::sphere(3000, 1, Vec3(1, 0, 0)))};
  const double h = 0.01;
  const points::Cloud dense = upsampled(solid, h);
  const auto normals = test::normals_of(dense);
  for (std::size_t i = 0; i < dense.size(); ++i) {
    const Vec3 p = dense.positions[i], from_b = p - Vec3(1, 0, 0);
    ASSERT_LT(p.x(), 0.5 + 1e-3) << "beyond the edge";
    const bool on_a = std::abs(p.norm() - 1) < std::abs(from_b.norm() - 1);
    ASSERT_LT(std::abs((on_a ? p : from_b).norm() - 1), 1e-4);
    if (p.x() < 0.5 - h) ASSERT_LT(test::degrees_between(normals[i], on_a ? p : Vec3(-from_b)), 0.2);
  }
  std::vector<Vec3> places;
  for (const Vec3& d : places_on_sphere(1)) {
    if (d.x() < 0.5) places.push_back(d);                         // of the ball
    if (d.x() < -0.5) places.push_back(Vec3(d + Vec3(1, 0, 0)));  // of the hollow
  }
  EXPECT_EQ(holes(dense, places), 0u);

  // Both sheets come up to the edge.
  for (const double side : {1.0, -1.0}) {
    std::vector<Vec3> sheet;
    for (std::size_t i = 0; i < dense.size(); ++i)
      if (side * normals[i].dot(dense.positions[i]) > 0) sheet.push_back(dense.positions[i]);
    const points::NeighbourSearch search(sheet);
    std::vector<points::Neighbour> near;
    for (int i = 0; i < 500; ++i) {
      const double a = 2 * std::numbers::pi * i / 500, r = std::sqrt(0.75);
      search.nearest(Vec3(0.5, r * std::cos(a), r * std::sin(a)), 1, near);
      EXPECT_LT(std::sqrt(near[0].squared_distance), 0.8 * h);
    }
  }
}

TEST(Upsample, BlendsAttributesAndTakesIntegersFromTheNearest) {
  points::Cloud cloud = test::sphere(2000);
  std::vector<double> velocity;
  std::vector<std::int64_t> half;
  for (const Vec3& p : cloud.positions) {
    const Vec3 v = Vec3(0.3, -1, 2).cross(p);
    velocity.insert(velocity.end(), v.data(), v.data() + 3);
    half.push_back(p.z() > 0 ? 1 : 0);
  }
  cloud.attributes.set(attribute::kVelocity, 3, velocity);
  cloud.attributes.set_integers("half", 1, half);
  const points::Cloud dense = upsampled(leaf(cloud), 0.02);
  const auto v = dense.attributes.values(attribute::kVelocity, 3);
  const auto h = dense.attributes.integers("half");
  ASSERT_EQ(v.size(), 3 * dense.size());
  ASSERT_EQ(h.size(), dense.size());
  for (std::size_t i = 0; i < dense.size(); ++i) {
    const Vec3 p = dense.positions[i];
    ASSERT_LT((Vec3(v[3 * i], v[3 * i + 1], v[3 * i + 2]) - Vec3(0.3, -1, 2).cross(p)).norm(), 0.05);
    if (std::abs(p.z()) > 0.1) ASSERT_EQ(h[i], p.z() > 0 ? 1 : 0);
  }
}

TEST(Upsample, GivesTheSameBitsForAnyNumberOfThreads) {
  const Solid torus = leaf(test::torus(2000, 1, 0.4));
  const points::Cloud one = upsampled(torus, 0.03, kNoLimit, RunControl({.threads = 1, .seed = 0, .on_progress = {}}));
  for (const int threads : {2, 5}) {
    const points::Cloud many =
        upsampled(torus, 0.03, kNoLimit, RunControl({.threads = threads, .seed = 0, .on_progress = {}}));
    ASSERT_EQ(many.positions, one.positions);
    EXPECT_EQ(test::normals_of(many), test::normals_of(one));
  }
}

TEST(Upsample, OfNothingIsNothing) {
  const points::Cloud none = upsampled(Solid(), 0.1);
  EXPECT_TRUE(none.empty());
  EXPECT_TRUE(none.attributes.has(attribute::kNormal));
}

}  // namespace
}  // namespace meniscus::pointset
