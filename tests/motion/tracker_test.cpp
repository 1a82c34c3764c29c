#include "motion/moving_scenes.h"

#include <meniscus/base/error.h>
#include <meniscus/motion/tracker.h>

#include <gtest/gtest.h>

#include <limits>
#include <numeric>

namespace meniscus::motion {
namespace {

using test::surface;

/// Tracks over `steps` equal steps and returns the last report.
StepReport follow(MeshTracker& tracker, field::Field& f, double duration, int steps) {
  const auto pose = [&](double t) -> const field::Field& {
    f.set_time(t);
    return f;
  };
  StepReport report;
  const double start = tracker.time();
  for (int k = 1; k <= steps; ++k) report = tracker.advance(pose, start + duration * k / steps);
  return report;
}

MeshTracker tracker(field::Field& f, double voxel, const TrackerOptions& options) {
  f.set_time(0);
  mesh::Mesh m = surface(f, voxel);
  fair(f, m, 5);
  return MeshTracker(std::move(m), f, 0, options);
}

TEST(MeshTracker, TranslationDoesNotDistort) {
  for (const double scale : {1.0, 0.01, 1000.0}) {
    for (const Velocity kind : {Velocity::Blended, Velocity::Total, Velocity::Isometric}) {
      for (const Integrator integrator : {Integrator::Euler, Integrator::Heun, Integrator::RungeKutta4}) {
        const auto f = test::carried_blobs(scale);
        MeshTracker t = tracker(*f, 0.25 * scale, {.velocity = {.kind = kind}, .integrator = integrator});
        const auto before = t.mesh().positions;
        const StepReport r = follow(t, *f, 1, 4);
        EXPECT_LT(r.area_log_max, 1e-9);
        EXPECT_EQ(r.flips + r.lost + r.singular, 0u);
        for (std::size_t i = 0; i < before.size(); ++i)
          EXPECT_LT((t.mesh().positions[i] - before[i] - scale * Vec3(0.7, -0.3, 0.5)).norm(), 1e-10 * scale);
      }
    }
  }
}

TEST(MeshTracker, NormalVelocityDistorts) {
  const auto f = test::carried_blobs();
  MeshTracker t = tracker(*f, 0.2, {.velocity = {.kind = Velocity::Normal}});
  EXPECT_GT(follow(t, *f, 1, 10).area_log_mean, 0.1);
}

TEST(MeshTracker, IntegratorsHaveTheirOrders) {
  // A full orbit's worth of error in a quarter turn, isometric velocities: the exact answer is known.
  const auto error = [](Integrator integrator, int steps) {
    const auto f = test::orbiting_blobs();
    MeshTracker t = tracker(*f, 0.3, {.velocity = {.kind = Velocity::Isometric}, .integrator = integrator});
    const auto before = t.mesh().positions;
    follow(t, *f, 1, steps);
    double worst = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
      const Vec3& p = before[i];
      const Vec3 exact(std::cos(1.0) * p.x() + std::sin(1.0) * p.z(), p.y(), std::cos(1.0) * p.z() - std::sin(1.0) * p.x());
      worst = std::max(worst, (t.mesh().positions[i] - exact).norm());
    }
    return worst;
  };
  EXPECT_NEAR(std::log2(error(Integrator::Euler, 8) / error(Integrator::Euler, 16)), 1, 0.3);
  EXPECT_NEAR(std::log2(error(Integrator::Heun, 8) / error(Integrator::Heun, 16)), 2, 0.3);
  EXPECT_NEAR(std::log2(error(Integrator::RungeKutta4, 4) / error(Integrator::RungeKutta4, 8)), 4, 0.6);
}

TEST(MeshTracker, StaysOnTheSurfaceAndCarriesWhatRidesOnIt) {
  // Nothing folds with `Blended`. `Total` keeps every normal, so a triangle keeps its image on the sphere of normals, which
  // has the triangle's orientation where Gaussian curvature is positive and the other where it is negative: a triangle over
  // which a parabolic line passes, as round the neck here, must fold, or be damped: a few in a tenth of a second.
  for (const Velocity kind : {Velocity::Blended, Velocity::Total}) {
    const auto f = test::approaching_blobs();
    f->set_time(0);
    mesh::Mesh m = surface(*f, 0.15);
    fair(*f, m, 5);
    std::vector<std::int64_t> ids(m.positions.size());
    for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<std::int64_t>(7 * i);
    m.attributes.set_integers("id", 1, ids);
    MeshTracker t(m, *f, 0, {.velocity = {.kind = kind}});
    const StepReport r = follow(t, *f, kind == Velocity::Blended ? 0.5 : 0.1, kind == Velocity::Blended ? 25 : 5);
    EXPECT_LT(r.max_distance, 1e-10);
    const std::size_t most = kind == Velocity::Blended ? 0 : t.mesh().triangles.size() / 20;
    EXPECT_LE(r.flips, most);
    EXPECT_EQ(r.lost, 0u);
    const auto carried = t.mesh().attributes.integers("id");
    EXPECT_TRUE(std::equal(carried.begin(), carried.end(), ids.begin(), ids.end()));
    const Velocities v = velocities(*f, t.mesh().positions, {.kind = kind});
    const auto written = t.mesh().attributes.values("v", 3);
    ASSERT_EQ(written.size(), 3 * v.velocity.size());
    for (std::size_t i = 0; i < v.velocity.size(); ++i)
      EXPECT_EQ(Vec3(written[3 * i], written[3 * i + 1], written[3 * i + 2]), v.velocity[i]);
  }
}

TEST(MeshTracker, FairingKeepsTheFirstMeshesLengths) {
  const auto distortion = [](int rounds) {
    const auto f = test::carried_blobs();
    MeshTracker t = tracker(*f, 0.25, {.velocity = {.kind = Velocity::Normal}, .fairing = rounds});
    const StepReport r = follow(t, *f, 0.5, 6);
    EXPECT_LT(r.max_distance, 1e-9);
    return r.area_log_mean;
  };
  const double without = distortion(0);
  const double some = distortion(5);
  const double many = distortion(40);
  EXPECT_LT(some, without);
  EXPECT_LT(many, some);
}

TEST(MeshTracker, FairingLeavesAnUnstrainedMeshAlone) {
  const auto f = test::carried_blobs();
  MeshTracker t = tracker(*f, 0.25, {.velocity = {.kind = Velocity::Total}, .fairing = 10});
  EXPECT_LT(follow(t, *f, 0.5, 3).area_log_max, 1e-9);
}

TEST(MeshTracker, AMendedMeshKeepsItsReferences) {
  const auto f = test::carried_blobs();
  const TrackerOptions options{.velocity = {.kind = Velocity::Normal}, .fairing = 3};
  MeshTracker t = tracker(*f, 0.25, options);
  MeshTracker same = tracker(*f, 0.25, options);
  follow(t, *f, 0.3, 3);
  const StepReport before = follow(same, *f, 0.3, 3);
  // The same mesh but for its last triangle, which counts as new.
  std::vector<std::int32_t> vertices(t.mesh().positions.size());
  std::vector<std::int32_t> triangles(t.mesh().triangles.size() - 1);
  std::iota(vertices.begin(), vertices.end(), 0);
  std::iota(triangles.begin(), triangles.end(), 0);
  t.replace(t.mesh(), vertices, triangles, *f);
  const StepReport after = t.measures();
  EXPECT_GT(after.area_log_mean, 0.05);
  EXPECT_NEAR(after.area_log_mean, before.area_log_mean, 2.0 / static_cast<double>(triangles.size()));
  EXPECT_LT(after.area_log_mean, before.area_log_mean);
  // Springs are as long as they were: the same step leads to the same mesh.
  follow(t, *f, 0.1, 1);
  follow(same, *f, 0.1, 1);
  EXPECT_EQ(t.mesh().positions, same.mesh().positions);
}

TEST(Fair, LeavesTheFirstVerticesAlone) {
  const auto f = test::carried_blobs();
  f->set_time(0);
  mesh::Mesh m = surface(*f, 0.25);
  const std::vector<Vec3> before = m.positions;
  const auto fixed = static_cast<std::ptrdiff_t>(before.size() / 2);
  fair(*f, m, 3, {}, before.size() / 2);
  EXPECT_TRUE(std::equal(before.begin(), before.begin() + fixed, m.positions.begin()));
  EXPECT_FALSE(std::equal(before.begin() + fixed, before.end(), m.positions.begin() + fixed));
}

TEST(MeshTracker, DiscontinuitiesDoNotDestabilise) {
  // A stick that pushes through a ball.
  std::vector<std::unique_ptr<field::Field>> parts;
  parts.push_back(field::sphere({0.0, 0.0, 0.0}, 0.8));
  parts.push_back(field::capsule({test::moving("-2+t"), 0.0, 0.1}, {test::moving("-0.9+t"), 0.0, 0.1}, 0.2));
  const auto f = field::set_union(std::move(parts));
  for (const Velocity kind : {Velocity::Normal, Velocity::Blended, Velocity::Total, Velocity::Isometric}) {
    MeshTracker t = tracker(*f, 0.1, {.velocity = {.kind = kind}});
    follow(t, *f, 0.5, 25);
    for (const Vec3& p : t.mesh().positions) {
      ASSERT_TRUE(p.allFinite());
      EXPECT_LT(p.norm(), 2.5);
    }
    // The stick has speed 1.
    for (const Vec3& v : t.velocities().velocity) EXPECT_LT(v.norm(), 2.1);
  }
}

TEST(Project, GoesNoFartherThanAllowed) {
  const auto f = field::sphere({0.0, 0.0, 0.0}, 1.0);
  std::vector<Vec3> x{{1.2, 0, 0}, {0, 1.2, 0}, {0, 0, 0}, {1, 0, 0}};
  std::vector<std::uint8_t> lost;
  EXPECT_EQ(project(*f, x, std::vector<double>{0.25, 0.1, 5, 0}, {}, &lost), 2u);
  EXPECT_LT((x[0] - Vec3(1, 0, 0)).norm(), 1e-14);
  EXPECT_EQ(x[1], Vec3(0, 1.2, 0));
  EXPECT_EQ(x[2], Vec3(0, 0, 0));
  EXPECT_EQ(x[3], Vec3(1, 0, 0));
  EXPECT_EQ(lost, (std::vector<std::uint8_t>{0, 1, 1, 0}));
}

TEST(PointTracker, FollowsAndDropsWhatIsLost) {
  const auto f = test::carried_blobs();
  f->set_time(0);
  points::Cloud cloud{surface(*f, 0.2).positions, {}};
  project(*f, cloud.positions, std::vector<double>(cloud.size(), 0.01));
  cloud.positions.push_back({40, 0, 0});
  const std::size_t n = cloud.size();
  PointTracker t(cloud, *f, 0, 0.2, {.velocity = {.kind = Velocity::Total}});
  const auto pose = [&](double at) -> const field::Field& {
    f->set_time(at);
    return *f;
  };
  EXPECT_EQ(t.advance(pose, 0.5).lost, 1u);
  ASSERT_EQ(t.cloud().size(), n - 1);
  EXPECT_LT(t.measures().max_distance, 1e-10);
  for (std::size_t i = 0; i + 1 < n; ++i)
    EXPECT_LT((t.cloud().positions[i] - cloud.positions[i] - 0.5 * Vec3(0.7, -0.3, 0.5)).norm(), 1e-10);
  EXPECT_THROW(t.advance(pose, std::numeric_limits<double>::infinity()), InvalidInput);
}

TEST(MeshTracker, IsTheSameForAnyNumberOfThreads) {
  std::vector<Vec3> first;
  for (const int threads : {1, 2, 3, 5, 8}) {
    RunControl run(RunOptions{.threads = threads, .seed = 0, .on_progress = {}});
    const auto f = test::approaching_blobs();
    f->set_time(0);
    const mesh::Mesh m = surface(*f, 0.12);
    std::vector<Vec3> last;
    run.execute([&] {
      MeshTracker t(m, *f, 0, {.velocity = {.kind = Velocity::Isometric}, .fairing = 2}, run);
      const auto pose = [&](double at) -> const field::Field& {
        f->set_time(at);
        return *f;
      };
      t.advance(pose, 0.1, run);
      last = t.mesh().positions;
    });
    if (threads == 1) first = last;
    EXPECT_EQ(last, first);
  }
}

}  // namespace
}  // namespace meniscus::motion
