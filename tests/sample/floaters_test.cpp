#include <meniscus/base/error.h>
#include <meniscus/sample/floaters.h>

#include "surfaces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace meniscus::sample {
namespace {

constexpr double kPi = 3.14159265358979323846;

RunControl with_threads(int n) { return RunControl({.threads = n, .seed = 0, .on_progress = {}}); }

double held_area(const Floaters& f) {
  double sum = 0;
  for (const double s : f.radii()) sum += 3.523 * s * s;
  return sum;
}

/// Share of the surface (by samples of its own) with no floater within `radius`.
double bare_share(const Floaters& f, const std::vector<Vec3>& probes, double radius) {
  std::size_t bare = 0;
  for (const Vec3& q : probes) {
    double nearest2 = 1e300;
    for (std::size_t i = 0; i < f.size(); ++i) nearest2 = std::min(nearest2, (f.points().position(i) - q).squaredNorm());
    bare += nearest2 > radius * radius;
  }
  return static_cast<double>(bare) / static_cast<double>(probes.size());
}

TEST(Floaters, SingleSeedFillsTheUnitSphere) {
  const auto sphere = test::sphere();
  Floaters f(Box::around(Vec3::Zero(), 1.5), {.radius = 0.05});
  const FloaterStep first = f.step(*sphere);
  EXPECT_EQ(first.seeded, 1u);
  f.settle(*sphere, 500);
  EXPECT_TRUE(f.settled());
  EXPECT_GE(f.size(), 1427u);
  EXPECT_LE(f.size(), 2912u);
  EXPECT_NEAR(held_area(f) / (4 * kPi), 1, 0.05);
  EXPECT_GT(f.measured(*sphere).packing, 0.75);
}

TEST(Floaters, TheSameGraphAtAnyScale) {
  // Powers of two scale without rounding: everything must agree to the last bit.
  const auto run = [](double scale) {
    const auto torus = test::torus(scale, 0.4 * scale);
    Floaters f(Box::around(Vec3::Zero(), 2 * scale), {.radius = 0.08 * scale});
    for (int k = 0; k < 80; ++k) f.step(*torus);
    std::vector<double> out;
    for (std::size_t i = 0; i < f.size(); ++i)
      out.insert(out.end(), {f.points().x[i] / scale, f.points().y[i] / scale, f.radii()[i] / scale});
    return out;
  };
  const auto one = run(1);
  EXPECT_EQ(one, run(1.0 / 128));
  EXPECT_EQ(one, run(1024));
}

TEST(Floaters, HundredthAndThousandfoldScaleSettleAlike) {
  std::vector<double> counts;
  for (const double scale : {1.0, 0.01, 1000.0}) {
    const auto sphere = test::sphere(scale);
    Floaters f(Box::around(Vec3::Zero(), 1.5 * scale), {.radius = 0.1 * scale});
    f.settle(*sphere, 500);
    EXPECT_TRUE(f.settled());
    EXPECT_NEAR(held_area(f) / (4 * kPi * scale * scale), 1, 0.05);
    counts.push_back(static_cast<double>(f.size()));
  }
  EXPECT_NEAR(counts[1] / counts[0], 1, 0.02);
  EXPECT_NEAR(counts[2] / counts[0], 1, 0.02);
}

TEST(Floaters, SameBitsForAnyThreadCount) {
  const auto run = [](int threads) {
    const auto blobs = test::three_blobs();
    Floaters f(Box::around(Vec3::Zero(), 2), {.radius = 0.06}, with_threads(threads));
    for (int k = 0; k < 50; ++k) f.step(*blobs);
    std::vector<double> out = f.points().x;
    out.insert(out.end(), f.radii().begin(), f.radii().end());
    return out;
  };
  const auto one = run(1);
  for (const int threads : {2, 3, 5, 8}) EXPECT_EQ(one, run(threads)) << threads;
}

TEST(Floaters, PopulationIsCappedAtEveryBirth) {
  const auto sphere = test::sphere();
  Floaters f(Box::around(Vec3::Zero(), 1.5), {.radius = 0.02, .max_count = 300});
  for (int k = 0; k < 100; ++k) {
    f.step(*sphere);
    ASSERT_LE(f.size(), 300u);
  }
  EXPECT_TRUE(f.capped());
}

TEST(Floaters, TranslationByOneRadiusPerStepLeavesNothingBehind) {
  const double radius = 0.1;
  const auto sphere_at = [](double x) { return test::sphere(1, {x, 0, 0}); };
  const Box box{Vec3(-2, -2, -2), Vec3(8, 2, 2)};
  Floaters f(box, {.radius = radius, .search_interval = 0});
  f.settle(*sphere_at(0), 400);
  const std::size_t before = f.size();
  std::size_t lost = 0;
  double x = 0;
  // The field knows nothing of its motion: it just stands elsewhere at the next step.
  for (int k = 0; k < 40; ++k) {
    x += radius;
    lost += f.step(*sphere_at(x)).lost.size();
  }
  EXPECT_EQ(lost, 0u);
  EXPECT_NEAR(static_cast<double>(f.size()), static_cast<double>(before), 0.25 * static_cast<double>(before));
  for (std::size_t i = 0; i < f.size(); ++i)
    EXPECT_LT(std::abs((f.points().position(i) - Vec3(x, 0, 0)).norm() - 1), 1.5 * radius);
}

TEST(Floaters, RatesOfTheFieldCarryThemAlong) {
  // The same motion announced: F_t moves them, so what remains is of second order.
  const double radius = 0.1, dt = 1.0 / 24, speed = radius / dt;
  const Box box{Vec3(-2, -2, -2), Vec3(8, 2, 2)};
  const test::FunctionField moving(
      [&](const Vec3& p, double t) {
        const Vec3 d = p - Vec3(speed * t, 0, 0);
        test::FunctionField::Jet j;
        j.f = d.norm() - 1;
        j.g = d.normalized();
        j.t = -speed * j.g.x();
        j.h = (Mat3::Identity() - j.g * j.g.transpose()) / d.norm();
        return j;
      },
      true);
  const auto posed = moving.clone();
  Floaters f(box, {.radius = radius, .search_interval = 0});
  f.settle(*posed, 400);
  for (int k = 0; k < 40; ++k) {
    posed->set_time(k * dt);
    EXPECT_TRUE(f.step(*posed, dt).lost.empty());
  }
  posed->set_time(40 * dt);
  for (std::size_t i = 0; i < f.size(); ++i) EXPECT_LT(std::abs(value_at(*posed, f.points().position(i))), 0.25 * radius);
}

TEST(Floaters, TwoBlobsThatSplitAndMergeStayCovered) {
  const double radius = 0.08;
  const Box box = Box::around(Vec3::Zero(), 3);
  const auto blobs_at = [](double d) {
    const field::Blob items[] = {{test::at(-d, 0, 0), 0.7, 1}, {test::at(d, 0, 0), 0.7, 1}};
    return field::blobs(field::BlobKernel::Gaussian, 0.35, items);
  };
  Floaters f(box, {.radius = radius});
  f.settle(*blobs_at(0.4), 400);
  std::set<std::int64_t> alive(f.ids().begin(), f.ids().end());
  for (int k = 0; k <= 120; ++k) {
    const double d = 0.8 - 0.4 * std::cos(k / 120.0 * 2 * kPi);
    const auto field = blobs_at(d);
    for (int sub = 0; sub < 3; ++sub) {
      const FloaterStep s = f.step(*field);
      for (const auto id : s.born) EXPECT_TRUE(alive.insert(id).second) << "an id came back";
      for (const auto id : s.died) EXPECT_EQ(alive.erase(id), 1u);
      for (const auto id : s.lost) EXPECT_EQ(alive.erase(id), 1u);
    }
    if (k % 30 != 0) continue;
    Floaters fresh(box, {.radius = radius});
    fresh.settle(*field, 400);
    std::vector<Vec3> probes;
    for (std::size_t i = 0; i < fresh.size(); ++i) probes.push_back(fresh.points().position(i));
    EXPECT_LT(bare_share(f, probes, 2.5 * radius), 0.005) << "d = " << d;
  }
  EXPECT_EQ(alive, std::set<std::int64_t>(f.ids().begin(), f.ids().end())) << "the log misses a birth or a death";
}

TEST(Floaters, ACylinderStretchedFourfoldIsEvenAgain) {
  const auto cylinder = [](double length) { return field::capsule({-length / 2, 0., 0.}, {length / 2, 0., 0.}, 0.4); };
  const Box box = Box::around(Vec3::Zero(), 3);
  Floaters before(box, {.radius = 0.08, .search_interval = 0});
  before.settle(*cylinder(1), 400);
  Floaters f(box, {.radius = 0.08, .search_interval = 0});
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Vec3 p = before.points().position(i);
    f.add({4 * p.x(), p.y(), p.z()}, before.points().normal(i), before.radii()[i]);
  }
  const auto stretched = cylinder(4);
  EXPECT_LT(f.measured(*stretched).packing, 0.6);
  for (int k = 0; k < 100; ++k) f.step(*stretched);
  const Evenness after = f.measured(*stretched);
  EXPECT_GT(after.packing, 0.8);
  EXPECT_LT(after.cover, 1.35);
  EXPECT_GT(f.size(), 2 * before.size());
}

TEST(Floaters, ASurfaceBornInMidRunIsSeededAndOneThatDiesIsLeft) {
  const Box box{Vec3(-2, -2, -2), Vec3(6, 2, 2)};
  const std::vector<double> radii{1, 0.5};
  const auto both = field::particles(std::vector<Vec3>{{0, 0, 0}, {4, 0, 0}}, radii);
  const auto first = field::particles(std::vector<Vec3>{{0, 0, 0}}, std::vector<double>{1});
  Floaters f(box, {.radius = 0.12});
  const auto count_right = [&] {
    return std::count_if(f.points().x.begin(), f.points().x.end(), [](double x) { return x > 2; });
  };
  f.settle(*first, 300);
  EXPECT_EQ(count_right(), 0);
  for (int k = 0; k < 120; ++k) f.step(*both);
  EXPECT_GT(count_right(), 30);
  std::size_t lost = 0;
  for (int k = 0; k < 40; ++k) lost += f.step(*first).lost.size();
  EXPECT_EQ(count_right(), 0);
  EXPECT_GT(lost, 30u);
}

TEST(Floaters, AThinTubeIsSampledWithoutRepulsionAcross) {
  // Tube radius below σ̂: were the far side felt, energies would be far above the wanted one and floaters would die out.
  const double radius = 0.1;
  const auto torus = test::torus(1, 0.09);
  Floaters f(Box::around(Vec3::Zero(), 1.5), {.radius = radius});
  f.settle(*torus, 400);
  const double area = 4 * kPi * kPi * 0.09;
  // As many as a flat piece of that area would hold, within the factor 2 that births and deaths leave open.
  EXPECT_GT(static_cast<double>(f.size()), area / (3.523 * radius * radius) * 0.8);
  EXPECT_EQ(bare_share(f, {{1.09, 0, 0}, {-0.91, 0, 0}, {0, 1, 0.09}, {0, -1, -0.09}}, 2.5 * radius), 0);
}

TEST(Floaters, GlobalRadiusReachesTheWantedOne) {
  const auto sphere = test::sphere();
  Floaters f(Box::around(Vec3::Zero(), 1.5), {.radius = 0.1, .method = FloaterOptions::Method::Global});
  f.settle(*sphere, 500);
  EXPECT_TRUE(f.settled());
  for (const double s : f.radii()) EXPECT_EQ(s, 0.1);
  EXPECT_LT(f.measured(*sphere).cover, 1.6);
}

TEST(Floaters, EveryReportedParticleIsOnTheSurface) {
  const auto blobs = test::three_blobs();
  const Box box = Box::around(Vec3::Zero(), 2);
  Floaters f(box, {.radius = 0.1});
  for (int k = 0; k < 60; ++k) f.step(*blobs);
  std::size_t dropped = 0;
  const points::Cloud cloud = f.cloud(*blobs, &dropped);
  EXPECT_EQ(cloud.size() + dropped, f.size());
  EXPECT_EQ(dropped, 0u);
  const field::JetBatch jets = field::evaluate(*blobs, cloud.positions, field::Order::Gradient);
  for (std::size_t i = 0; i < cloud.size(); ++i)
    EXPECT_LE(std::abs(jets.value(i)), 1e-9 * box.diameter() * jets.gradient(i).norm());
  const auto ids = cloud.attributes.integers("id");
  EXPECT_TRUE(std::is_sorted(ids.begin(), ids.end()));
}

TEST(Floaters, NoSurfaceAndNanEndQuietly) {
  const auto sphere = test::sphere();
  Floaters none(Box::around(Vec3(9, 0, 0), 1), {.radius = 0.1});
  for (int k = 0; k < 5; ++k) none.step(*sphere);
  EXPECT_EQ(none.size(), 0u);
  // A surface larger than the spacing asked for: one particle or a few, no endless growth.
  Floaters coarse(Box::around(Vec3::Zero(), 2), {.radius = 50});
  coarse.settle(*sphere, 100);
  EXPECT_GE(coarse.size(), 1u);
  EXPECT_LT(coarse.size(), 20u);
  const test::FunctionField half_nan([](const Vec3& p, double) {
    test::FunctionField::Jet j{.f = p.x() > 0 ? std::nan("") : p.norm() - 1, .g = p.normalized()};
    return j;
  });
  Floaters f(Box::around(Vec3::Zero(), 2), {.radius = 0.2});
  f.settle(half_nan, 100);
  for (std::size_t i = 0; i < f.size(); ++i) EXPECT_TRUE(f.points().position(i).allFinite());
}

TEST(Floaters, BadOptionsAreRefused) {
  const Box box = Box::around(Vec3::Zero(), 1);
  EXPECT_THROW(Floaters(box, {.radius = 0}), InvalidInput);
  EXPECT_THROW(Floaters(box, {.radius = -1}), InvalidInput);
  EXPECT_THROW(Floaters(box, {.radius = std::nan("")}), InvalidInput);
  EXPECT_THROW(Floaters(Box{}, {.radius = 0.1}), InvalidInput);
  EXPECT_THROW(Floaters(Box::everywhere(), {.radius = 0.1}), InvalidInput);
  EXPECT_THROW(Floaters(box, {.radius = 0.1, .time_step = 0.2}), InvalidInput);
  EXPECT_THROW(Floaters(box, {.radius = 0.1, .momentum = 1}), InvalidInput);
}

}  // namespace
}  // namespace meniscus::sample
