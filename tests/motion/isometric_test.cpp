#include "motion/moving_scenes.h"

#include <meniscus/base/error.h>
#include <meniscus/motion/isometric.h>
#include <meniscus/motion/tracker.h>

#include <gtest/gtest.h>

namespace meniscus::motion {
namespace {

using test::surface;

Velocities blended(const field::Field& f, const mesh::Mesh& m) { return velocities(f, m.positions, {}); }

TEST(IsometricSolver, ReproducesRigidMotions) {
  const auto f = test::orbiting_blobs();
  for (const double t : {0.0, 0.8}) {
    f->set_time(t);
    const mesh::Mesh m = surface(*f, 0.08);
    Velocities v = blended(*f, m);
    double before = 0;
    for (std::size_t i = 0; i < v.velocity.size(); ++i)
      before = std::max(before, (v.velocity[i] - test::orbit_velocity(m.positions[i])).norm());
    EXPECT_GT(before, 0.1);
    EXPECT_LT(IsometricSolver(m).solve(m.positions, v), 1e-8);
    for (std::size_t i = 0; i < v.velocity.size(); ++i)
      EXPECT_LT((v.velocity[i] - test::orbit_velocity(m.positions[i])).norm(), 1e-8) << i;
  }
}

TEST(IsometricSolver, ReproducesTurningAboutAnyAxisAtAnyScale) {
  for (const double scale : {0.01, 1.0, 1000.0}) {
    const auto f = field::transform(test::three_blobs(scale), {test::moving(test::text(scale) + "*t"), 0.0, 0.0},
                                    {test::moving("40*t"), test::moving("-25*t"), test::moving("10*t")}, 1.0);
    f->set_time(0);
    const mesh::Mesh m = surface(*f, 0.1 * scale);
    Velocities v = velocities(*f, m.positions, {.kind = Velocity::Normal});  // a guide that knows nothing
    IsometricSolver(m).solve(m.positions, v);
    const double degree = 3.14159265358979323846 / 180;
    const Vec3 w = degree * Vec3(40, -25, 10);
    for (std::size_t i = 0; i < v.velocity.size(); ++i)
      EXPECT_LT((v.velocity[i] - scale * Vec3(1, 0, 0) - w.cross(m.positions[i])).norm(), 1e-8 * scale);
  }
}

TEST(IsometricSolver, FollowsTheGuideWhereStrainLeavesItOpen) {
  // A sphere that turns, as its material says, about its own axis while it moves.
  const auto f = field::transform(field::sphere({0.0, 0.0, 0.0}, 1.0), {test::moving("0.4*t"), 0.0, 0.0},
                                  {0.0, test::moving("57.29577951308232*t"), 0.0}, 1.0);
  f->set_time(0);
  const mesh::Mesh m = surface(*f, 0.12);
  Velocities v = blended(*f, m);
  IsometricSolver(m).solve(m.positions, v);
  for (std::size_t i = 0; i < v.velocity.size(); ++i)
    EXPECT_LT((v.velocity[i] - Vec3(0.4, 0, 0) - test::orbit_velocity(m.positions[i])).norm(), 1e-7);
}

TEST(IsometricSolver, StrainsNoMoreThanItsGuide) {
  const auto f = test::approaching_blobs();
  const mesh::Mesh m = surface(*f, 0.1);
  Velocities v = blended(*f, m);
  const Velocities guide = v;
  const double strain = IsometricSolver(m).solve(m.positions, v);
  double own = 0;
  double guides = 0;
  for (const mesh::Mesh& x : {m})
    for (const Triangle& t : x.triangles)
      for (int k = 0; k < 3; ++k) {
        const auto i = static_cast<std::size_t>(t[static_cast<std::size_t>(k)]);
        const auto j = static_cast<std::size_t>(t[static_cast<std::size_t>((k + 1) % 3)]);
        const Vec3 e = x.positions[j] - x.positions[i];
        own += std::pow(e.dot(v.velocity[j] - v.velocity[i]) / e.squaredNorm(), 2);
        guides += std::pow(e.dot(guide.velocity[j] - guide.velocity[i]) / e.squaredNorm(), 2);
      }
  EXPECT_LT(own, guides);
  EXPECT_GT(strain, 0);
  for (std::size_t i = 0; i < v.velocity.size(); ++i) EXPECT_NEAR(v.normal[i].dot(v.velocity[i]), v.normal_speed[i], 1e-12);
}

TEST(IsometricSolver, SolvesAgainForMovedVertices) {
  const auto f = test::orbiting_blobs();
  f->set_time(0);
  const mesh::Mesh m = surface(*f, 0.12);
  IsometricSolver solver(m);
  Velocities v = blended(*f, m);
  solver.solve(m.positions, v);
  std::vector<Vec3> moved(m.positions);
  const double angle = 0.7;
  for (Vec3& p : moved)
    p = Vec3(std::cos(angle) * p.x() + std::sin(angle) * p.z(), p.y(), std::cos(angle) * p.z() - std::sin(angle) * p.x());
  f->set_time(angle);
  Velocities w = velocities(*f, moved, {});
  solver.solve(moved, w);
  for (std::size_t i = 0; i < moved.size(); ++i) EXPECT_LT((w.velocity[i] - test::orbit_velocity(moved[i])).norm(), 1e-8);
}

TEST(IsometricSolver, HardlyDependsOnWhereItComesFrom) {
  const auto f = test::approaching_blobs();
  f->set_time(0);
  const mesh::Mesh m = surface(*f, 0.1);
  const auto at = [&](IsometricSolver& solver, double t) {
    f->set_time(t);
    std::vector<Vec3> x(m.positions);
    project(*f, x, std::vector<double>(x.size(), 1));
    Velocities v = velocities(*f, x, {});
    solver.solve(x, v);
    return v;
  };
  IsometricSolver used(m);
  for (const double t : {0.0, 0.05, 0.1, 0.15}) at(used, t);
  IsometricSolver same(m);
  same.recall(used.memory());
  IsometricSolver fresh(m);
  const Velocities a = at(used, 0.2);
  const Velocities b = at(fresh, 0.2);
  EXPECT_EQ(a.velocity, at(same, 0.2).velocity) << "memory is all that it goes by";
  double most = 0;
  for (std::size_t i = 0; i < a.velocity.size(); ++i) most = std::max(most, (a.velocity[i] - b.velocity[i]).norm());
  EXPECT_LT(most, 1e-3);  // to a thousandth of the load  // the blobs have speed 0.5
  EXPECT_GT(most, 0);
  EXPECT_THROW(IsometricSolver(m).recall({}), InvalidInput);
}

TEST(IsometricSolver, RefusesWhatIsNotAMesh) {
  mesh::Mesh bad;
  bad.positions = {{0, 0, 0}, {1, 0, 0}};
  bad.triangles = {{0, 1, 7}};
  EXPECT_THROW(IsometricSolver{bad}, InvalidInput);
  const mesh::Mesh empty;
  Velocities none;
  EXPECT_EQ(IsometricSolver(empty).solve({}, none), 0);
}

}  // namespace
}  // namespace meniscus::motion
