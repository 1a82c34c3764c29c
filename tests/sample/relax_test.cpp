#include <meniscus/base/random.h>
#include <meniscus/sample/front.h>
#include <meniscus/sample/relax.h>
#include <meniscus/sample/seeds.h>

#include "surfaces.h"

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::sample {
namespace {

constexpr double kSpacing = 0.06;

/// Points of a torus, those near one of them first, shaken; and how many those are.
struct Patch {
  std::unique_ptr<field::Field> torus = test::torus(1, 0.4);
  Box box = Box::around(Vec3::Zero(), 1.6);
  SurfacePoints points;
  std::vector<std::uint8_t> movable;
  std::size_t near = 0;

  Patch() {
    const Seeds seeds = find_seeds(*torus, box, {.resolution = 0.05, .tolerance = 1e-9});
    const Front front = grow_front(*torus, box, seeds.points, {.spacing = kSpacing, .max_count = 10000, .tolerance = 1e-9});
    const Vec3 center = front.points.position(0);
    std::vector<std::uint32_t> order, rest;
    for (std::uint32_t i = 0; i < front.points.size(); ++i)
      ((front.points.position(i) - center).norm() < 8 * kSpacing ? order : rest).push_back(i);
    near = order.size();
    order.insert(order.end(), rest.begin(), rest.end());
    points = front.points.gathered(order);
    for (std::size_t i = 0; i < points.size(); ++i) {
      movable.push_back((points.position(i) - center).norm() < 4 * kSpacing);
      if (!movable[i]) continue;
      const auto u = random_uniform(1, i, 0);
      points.set_position(i, points.position(i) + 0.7 * kSpacing * Vec3(u[0] - 0.5, u[1] - 0.5, u[2] - 0.5));
    }
  }

  SurfacePoints relaxed(std::size_t count) const {
    std::vector<std::uint32_t> first(count);
    for (std::uint32_t i = 0; i < count; ++i) first[i] = i;
    SurfacePoints p = points.gathered(first);
    relax(*torus, box, p, std::vector<double>(count, kSpacing), {.steps = 30}, {},
          std::span<const std::uint8_t>(movable).first(count));
    return p;
  }
};

TEST(Relax, WhatStandsStillFarAwayChangesNothing) {
  const Patch patch;
  ASSERT_GT(patch.points.size(), 10 * patch.near);
  const SurfacePoints alone = patch.relaxed(patch.near), among = patch.relaxed(patch.points.size());
  // Forces are in single precision: 2^-24 of the 53 spacings of the box, in each of 30 steps.
  const double bound = 30 * 53 * std::ldexp(1.0, -24) * kSpacing;
  for (std::size_t i = 0; i < patch.near; ++i) EXPECT_LT((alone.position(i) - among.position(i)).norm(), bound) << i;
}

TEST(Relax, WhatMayNotMoveStays) {
  const Patch patch;
  const SurfacePoints after = patch.relaxed(patch.points.size());
  for (std::size_t i = 0; i < patch.points.size(); ++i)
    if (!patch.movable[i]) EXPECT_EQ(after.position(i), patch.points.position(i));
}

}  // namespace
}  // namespace meniscus::sample
