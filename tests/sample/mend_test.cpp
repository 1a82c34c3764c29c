#include <meniscus/sample/evenness.h>
#include <meniscus/sample/front.h>
#include <meniscus/sample/mend.h>
#include <meniscus/sample/relax.h>
#include <meniscus/sample/seeds.h>

#include "surfaces.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace meniscus::sample {
namespace {

struct Made {
  std::unique_ptr<field::Field> torus = test::torus(1, 0.4);
  Box box = Box::around(Vec3::Zero(), 1.6);
  Population population;

  Made() {
    const Seeds seeds = find_seeds(*torus, box, {.resolution = 0.05, .tolerance = 1e-9});
    Front front = grow_front(*torus, box, seeds.points, {.spacing = 0.09, .max_count = 10000, .tolerance = 1e-9});
    population = {std::move(front.points), std::move(front.spacing)};
    fit_spacing(population, box);
    relax(*torus, box, population.points, population.spacing, {.steps = 60});
  }
  Evenness even() const { return evenness(*torus, box, population.points, population.spacing); }
};

TEST(Mend, RepairsAPairAndAVacancyAndKeepsTheCount) {
  Made m;
  const std::size_t n = m.population.points.size();
  const Vec3 elsewhere = m.population.points.position(n / 4);
  const Vec3 normal = m.population.points.normal(n / 4);
  // One particle out of its place, next to another.
  m.population.points.set_position(n / 2, elsewhere + 0.02 * normal.unitOrthogonal());
  m.population.points.set_normal(n / 2, normal);
  const Evenness broken = m.even();
  EXPECT_LT(broken.packing, 0.5);
  EXPECT_GT(broken.cover, 1.5);
  EXPECT_EQ(mend(*m.torus, m.box, {.count = n, .max_count = 2 * n}, m.population).faults, 0u);
  const Evenness after = m.even();
  EXPECT_EQ(after.count, n);
  EXPECT_GT(after.packing, 0.86);
  EXPECT_LT(after.cover, 1.24);
}

TEST(Mend, LeavesWhatIsFarFromAFaultAlone) {
  Made m;
  mend(*m.torus, m.box, {.max_count = 100000}, m.population);
  const SurfacePoints before = m.population.points;
  EXPECT_EQ(mend(*m.torus, m.box, {.max_count = 100000}, m.population).faults, 0u);
  ASSERT_EQ(before.size(), m.population.points.size());
  for (std::size_t i = 0; i < before.size(); ++i)
    EXPECT_LT((before.position(i) - m.population.points.position(i)).norm(), 1e-6);
}

TEST(Mend, SameBitsForAnyThreadCount) {
  const auto run = [](int threads) {
    Made m;
    mend(*m.torus, m.box, {.packing = 0.9, .cover = 1.2, .attempts = 4, .max_count = 100000}, m.population,
         RunControl({.threads = threads, .seed = 3, .on_progress = {}}));
    return m.population.points.x;
  };
  const auto one = run(1);
  for (const int threads : {2, 3, 8}) EXPECT_EQ(one, run(threads)) << threads;
}

}  // namespace
}  // namespace meniscus::sample
