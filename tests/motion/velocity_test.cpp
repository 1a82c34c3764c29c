#include "motion/moving_scenes.h"

#include <meniscus/base/error.h>
#include <meniscus/field/expression.h>
#include <meniscus/motion/velocity.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace meniscus::motion {
namespace {

using test::surface;

constexpr Velocity kKinds[] = {Velocity::Normal, Velocity::Blended, Velocity::Total, Velocity::Isometric};

Velocities at(const field::Field& f, const std::vector<Vec3>& x, Velocity kind) { return velocities(f, x, {.kind = kind}); }

double worst(const std::vector<Vec3>& a, const Vec3& b) {
  double w = 0;
  for (const Vec3& v : a) w = std::max(w, (v - b).norm());
  return w;
}

TEST(Velocity, TranslationIsExact) {
  for (const double scale : {1.0, 0.01, 1000.0}) {
    const auto f = test::carried_blobs(scale);
    const auto x = surface(*f, 0.1 * scale).positions;
    ASSERT_GT(x.size(), 1000u);
    const Vec3 u = scale * Vec3(0.7, -0.3, 0.5);
    EXPECT_LT(worst(at(*f, x, Velocity::Blended).velocity, u), 1e-13 * scale) << scale;
    EXPECT_LT(worst(at(*f, x, Velocity::Total).velocity, u), 1e-11 * scale) << scale;
    EXPECT_LT(worst(at(*f, x, Velocity::Isometric).velocity, u), 1e-11 * scale) << scale;
    EXPECT_GT(worst(at(*f, x, Velocity::Normal).velocity, u), 0.5 * scale);
  }
}

TEST(Velocity, TheNormalPartIsTheSurfaces) {
  const auto f = test::approaching_blobs();
  const auto x = surface(*f, 0.1).positions;
  const auto jets = field::evaluate(*f, x, field::Order::GradientTime);
  for (const Velocity kind : kKinds) {
    const Velocities v = at(*f, x, kind);
    for (std::size_t i = 0; i < x.size(); ++i) {
      ASSERT_EQ(v.singular[i], 0);
      const double rest = jets.time(i) + jets.gradient(i).dot(v.velocity[i]);
      EXPECT_NEAR(rest / jets.gradient(i).norm(), 0, 1e-12);
    }
  }
}

TEST(Velocity, TotalDoesNotTurnNormals) {
  const std::unique_ptr<field::Field> scenes[] = {test::carried_blobs(), test::approaching_blobs(), test::orbiting_blobs()};
  const double dt = 1e-5;
  for (const auto& f : scenes) {
    f->set_time(0);
    const auto x = surface(*f, 0.1).positions;
    const Velocities v = at(*f, x, Velocity::Total);
    std::vector<Vec3> ahead(x);
    std::vector<Vec3> behind(x);
    for (std::size_t i = 0; i < x.size(); ++i) ahead[i] += dt * v.velocity[i], behind[i] -= dt * v.velocity[i];
    f->set_time(dt);
    const auto after = field::evaluate(*f, ahead, field::Order::Gradient);
    f->set_time(-dt);
    const auto before = field::evaluate(*f, behind, field::Order::Gradient);
    std::size_t regular = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (v.confidence[i] < 1) continue;
      ++regular;
      const Vec3 turn = (after.gradient(i).normalized() - before.gradient(i).normalized()) / (2 * dt);
      EXPECT_LT(turn.norm(), 1e-6) << x[i].transpose();
    }
    EXPECT_GT(regular, x.size() / 2);
  }
}

TEST(Velocity, LeadsToTheNextSurfaceWithSecondOrder) {
  const auto f = test::approaching_blobs();
  const auto x = surface(*f, 0.1).positions;
  for (const Velocity kind : kKinds) {
    f->set_time(0);
    const Velocities v = at(*f, x, kind);
    double distance[2];
    for (int k = 0; k < 2; ++k) {
      const double dt = k == 0 ? 0.02 : 0.01;
      std::vector<Vec3> next(x);
      for (std::size_t i = 0; i < x.size(); ++i) next[i] += dt * v.velocity[i];
      f->set_time(dt);
      const auto jets = field::evaluate(*f, next, field::Order::Gradient);
      distance[k] = 0;
      for (std::size_t i = 0; i < x.size(); ++i)
        distance[k] += std::abs(jets.value(i)) / jets.gradient(i).norm() / static_cast<double>(x.size());
    }
    const double order = std::log2(distance[0] / distance[1]);
    EXPECT_NEAR(order, 2, 0.1) << static_cast<int>(kind);
  }
}

TEST(Velocity, IsBoundedWhereGaussianCurvatureVanishes) {
  // Compact blobs of a peanut have parabolic lines round the neck; the fastest primitive has speed 0.5385.
  const auto f = test::approaching_blobs();
  const auto x = surface(*f, 0.03).positions;
  const Velocities v = velocities(*f, x, {.kind = Velocity::Total, .fastest = std::sqrt(0.29)});
  std::size_t damped = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    damped += v.confidence[i] < 1 ? 1 : 0;
    const Vec3 tangential = v.velocity[i] - v.normal_speed[i] * v.normal[i];
    EXPECT_LE(tangential.norm(), 2 * std::sqrt(0.29) * (1 + 1e-12));
  }
  EXPECT_GT(damped, 0u);
}

TEST(Velocity, IsNeverTwiceAsFastAsTheFastestPrimitiveWhateverIsKnownOfIt) {
  // Speeds of the primitives: |(0.7, −0.3, 0.5)|; (0.5, 0.2); 1 rad/s times the largest distance of a centre from the axis.
  const std::pair<std::unique_ptr<field::Field>, double> scenes[] = {{test::carried_blobs(), std::sqrt(0.83)},
                                                                     {test::approaching_blobs(), std::sqrt(0.29)},
                                                                     {test::orbiting_blobs(), 0.75}};
  for (const auto& [f, fastest] : scenes) {
    for (const double t : {0.0, 0.4}) {
      f->set_time(t);
      const auto x = surface(*f, 0.06).positions;
      for (const Velocity kind : {Velocity::Normal, Velocity::Blended, Velocity::Total}) {
        const Velocities v = at(*f, x, kind);
        for (std::size_t i = 0; i < x.size(); ++i)
          EXPECT_LE((v.velocity[i] - v.normal_speed[i] * v.normal[i]).norm(), 2 * fastest * (1 + 1e-9));
      }
    }
  }
}

TEST(Velocity, FallsBackToBlendedWithoutCurvature) {
  // A cylinder's axis and a plane have none.
  const auto cylinder = field::capsule({test::moving("t"), test::moving("0.2*t"), -50.0},
                                       {test::moving("t"), test::moving("0.2*t"), 50.0}, 1.0);
  const std::vector<Vec3> x{{1, 0, 0}, {0, 1, 3}, {std::sqrt(0.5), -std::sqrt(0.5), -7}};
  EXPECT_LT(worst(at(*cylinder, x, Velocity::Total).velocity, {1, 0.2, 0}), 1e-12);
  const auto plane = field::plane({test::moving("3*t"), test::moving("0.5*t"), 0.0}, {0.0, 1.0, 0.0});
  const auto total = at(*plane, {{0, 0, 0}, {4, 0, 1}}, Velocity::Total);
  EXPECT_LT(worst(total.velocity, {3, 0.5, 0}), 1e-13);
  EXPECT_EQ(total.confidence[0], 0);
}

TEST(Velocity, LocalFitReproducesRigidMotionsWhereTheyAreDetermined) {
  // Where one blob alone reaches, a compact blob's surface is a sphere, whose turning cannot be seen: a patch can know the
  // motion only if it holds points that two blobs reach, and the second shows there by the cube of its depth. How much must
  // show: a slide u along a surface z = k x²/2 + k' x³/6 changes the normal speed by k x u + k' x² u/2, of which turning the
  // patch takes away the first term; in a patch of radius ρ some k'ρ²/10 u is left, and full trust starts at 1e-3.
  const auto f = test::orbiting_blobs();
  f->set_time(0);
  const auto x = surface(*f, 0.06).positions;
  const std::pair<Vec3, double> blobs[] = {{{0.75, 0, 0}, 1.3}, {{-0.45, 0.2, 0.6}, 1.1}, {{-0.3, -0.35, -0.55}, 1.2}};
  std::vector<Vec3> seam;  // points that two blobs reach
  for (const Vec3& p : x) {
    int reached = 0;
    for (const auto& [c, r] : blobs) reached += (p - c).norm() < r ? 1 : 0;
    if (reached > 1) seam.push_back(p);
  }
  const Velocities blended = at(*f, x, Velocity::Blended);
  double off = 0;
  for (std::size_t i = 0; i < x.size(); ++i) off = std::max(off, (blended.velocity[i] - test::orbit_velocity(x[i])).norm());
  EXPECT_GT(off, 0.1);
  double before = 0;
  for (const auto& [neighbours, least] : {std::pair<std::size_t, double>{48, 0.12}, {96, 0.16}, {192, 0.22}}) {
    const double radius = 0.2 * std::sqrt(static_cast<double>(neighbours) / 48);
    double possible = 0;
    for (const Vec3& p : x)
      for (const Vec3& q : seam)
        if ((p - q).norm() < radius) {
          ++possible;
          break;
        }
    const Velocities fit = velocities(*f, x, {.kind = Velocity::Isometric, .neighbours = neighbours});
    double sure = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (fit.confidence[i] < 1) continue;
      ++sure;
      EXPECT_LT((fit.velocity[i] - test::orbit_velocity(x[i])).norm(), 1e-8);
    }
    EXPECT_LE(sure, possible);
    EXPECT_GT(sure, least * static_cast<double>(x.size())) << neighbours;
    EXPECT_GT(sure, before);
    before = sure;
  }
}

TEST(Velocity, DoesNotDependOnTheSignOfF) {
  const std::string formula = "(x-0.3*t)^2+1.4*(y+0.2*t*z)^2+0.7*z^2*(1+0.3*t)-1+0.1*t";
  const field::Expression f(formula);
  const field::Expression g("-(" + formula + ")");
  const std::vector<Vec3> x{{0.9, 0.1, 0.2}, {-0.3, 0.7, 0.4}, {0.1, -0.5, 0.9}, {0.4, -0.6, -0.5}};
  for (const Velocity kind : {Velocity::Normal, Velocity::Blended, Velocity::Total}) {
    const Velocities a = at(f, x, kind);
    const Velocities b = at(g, x, kind);
    for (std::size_t i = 0; i < x.size(); ++i) {
      EXPECT_LT((a.velocity[i] - b.velocity[i]).norm(), 1e-13);
      EXPECT_LT((a.normal[i] + b.normal[i]).norm(), 1e-13);
    }
  }
}

TEST(Velocity, ScalesWithTheScene) {
  const auto f = test::approaching_blobs();
  const auto x = surface(*f, 0.1).positions;
  for (const double scale : {0.01, 1000.0}) {
    const auto g = test::approaching_blobs(scale);
    std::vector<Vec3> y(x);
    for (Vec3& p : y) p *= scale;
    for (const Velocity kind : kKinds) {
      const Velocities a = at(*f, x, kind);
      const Velocities b = at(*g, y, kind);
      for (std::size_t i = 0; i < x.size(); ++i)
        ASSERT_LT((scale * a.velocity[i] - b.velocity[i]).norm(), 1e-9 * scale) << static_cast<int>(kind) << ' ' << i;
    }
  }
}

TEST(Velocity, FlagsWhereSheetsMeet) {
  // Two sheets at x = ±√(t0 − t) in the limit: |∇F| → 0 and v_n → ∞ as 1/√. F = x² − y² + t − 1e-6 near the saddle.
  const field::Expression f("x^2-y^2-z^2+1e-12-t");
  const std::vector<Vec3> x{{0, 1e-6, 0}, {1, 1, 0}};
  const Velocities v = velocities(f, x, {.kind = Velocity::Normal, .resolution = 1e-3});
  EXPECT_EQ(v.singular[0], 1);
  EXPECT_EQ(v.confidence[0], 0);
  EXPECT_NEAR(std::abs(v.normal_speed[0]), 1 / (1e-3 * std::sqrt(12.0)), 1e-6);
  EXPECT_EQ(v.singular[1], 0);
  EXPECT_NEAR(v.normal_speed[1], 1 / std::sqrt(8.0), 1e-12);
}

TEST(Velocity, SurvivesPointsWithoutSurface) {
  const auto f = test::carried_blobs();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Vec3> x{{nan, 0, 0}, {100, 0, 0}, {1.2, 0, 0}};  // not finite, out of reach, near the surface
  for (const Velocity kind : kKinds) {
    const Velocities v = at(*f, x, kind);
    for (int i = 0; i < 2; ++i) EXPECT_EQ(v.velocity[static_cast<std::size_t>(i)], Vec3(0, 0, 0));
    EXPECT_EQ(v.singular[0], 1);
    EXPECT_TRUE(v.velocity[2].allFinite());
    EXPECT_EQ(at(*f, {}, kind).velocity.size(), 0u);
  }
  EXPECT_THROW(velocities(*f, x, {.resolution = -1.0}), InvalidInput);
  EXPECT_THROW(velocities(*f, x, {.fastest = nan}), InvalidInput);
}

TEST(Velocity, IsTheSameForAnyNumberOfThreads) {
  const auto f = test::approaching_blobs();
  const auto x = surface(*f, 0.05).positions;
  for (const Velocity kind : kKinds) {
    std::vector<Vec3> first;
    for (const int threads : {1, 2, 3, 5, 8}) {
      RunControl run(RunOptions{.threads = threads, .seed = 0, .on_progress = {}});
      std::vector<Vec3> v;
      run.execute([&] { v = velocities(*f, x, {.kind = kind}, run).velocity; });
      if (threads == 1) first = v;
      EXPECT_EQ(v, first);
    }
  }
}

}  // namespace
}  // namespace meniscus::motion
