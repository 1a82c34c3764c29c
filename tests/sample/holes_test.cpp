#include <meniscus/sample/holes.h>
#include <meniscus/sample/spread.h>

#include "surfaces.h"

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::sample {
namespace {

SurfacePoints points_of(const points::Cloud& cloud) {
  SurfacePoints p;
  const auto n = cloud.attributes.values("N", 3);
  for (std::size_t i = 0; i < cloud.size(); ++i) p.push_back(cloud.positions[i], {n[3 * i], n[3 * i + 1], n[3 * i + 2]});
  return p;
}

std::vector<Hole> holes_of(const field::Field& surface, const Box& box, const SurfacePoints& p, double spacing,
                           double least) {
  const std::vector<double> all(p.size(), spacing);
  const Neighbours near = cell_neighbours(p, all);
  return find_holes(surface, box, p, all, near, measure_cells(p, all, near, box), least);
}

TEST(Holes, AMissingParticleLeavesOneAtItsPlace) {
  const Box box = Box::around(Vec3::Zero(), 1.7);
  const auto torus = test::torus(1, 0.4);
  const Sampling s = spread(*torus, box, {.count = 1500});
  SurfacePoints p = points_of(s.cloud);
  const Vec3 gone = p.position(700);
  std::vector<std::uint32_t> kept;
  for (std::uint32_t i = 0; i < p.size(); ++i)
    if (i != 700) kept.push_back(i);
  p = p.gathered(kept);
  const std::vector<Hole> holes = holes_of(*torus, box, p, s.report.spacing, 0.8);
  ASSERT_FALSE(holes.empty());
  for (const Hole& h : holes) EXPECT_LT((h.center - gone).norm(), 0.5 * s.report.spacing);
  EXPECT_NEAR(holes.front().radius, 1, 0.15);
}

TEST(Holes, OfAThinBodyLieOnItsSurface) {
  // A plate whose rim is far sharper than the spacing: corners of tangent planes there float off the surface. What a dense
  // sampling of the same plate says about the largest empty circle bounds what may be found.
  const auto plate = field::ellipsoid(test::at(0, 0, 0), test::at(1, 1, 0.05));
  const Box box = Box::around(Vec3::Zero(), 1.2);
  const Sampling s = spread(*plate, box, {.spacing = 0.15});
  const SurfacePoints p = points_of(s.cloud), probes = points_of(spread(*plate, box, {.spacing = 0.02, .fast = true}).cloud);
  const std::vector<Hole> holes = holes_of(*plate, box, p, s.report.spacing, 0);
  double truth = 0;
  for (std::size_t k = 0; k < probes.size(); ++k) {
    double nearest = 1e300;
    for (std::size_t i = 0; i < p.size(); ++i)
      if (probes.normal(k).dot(p.normal(i)) > -0.5) nearest = std::min(nearest, (p.position(i) - probes.position(k)).norm());
    truth = std::max(truth, nearest / s.report.spacing);
  }
  ASSERT_FALSE(holes.empty());
  EXPECT_NEAR(holes.front().radius, truth, 0.15 * truth);
  for (const Hole& h : holes) EXPECT_LT(std::abs(value_at(*plate, h.center)), 1e-6);
}

TEST(Holes, AroundARimAreEmptyOfAllThatRepel) {
  // What stands around the rim of a thin plate counts while it would still push (up to 120°).
  const auto plate = field::ellipsoid(test::at(0, 0, 0), test::at(1, 1, 0.05));
  const Box box = Box::around(Vec3::Zero(), 1.2);
  const Sampling s = spread(*plate, box, {.spacing = 0.15});
  const SurfacePoints p = points_of(s.cloud);
  const std::vector<double> all(p.size(), s.report.spacing);
  const std::vector<CellMeasure> cells = measure_cells(p, all, cell_neighbours(p, all), box);
  int seen = 0;
  for (const Hole& h : holes_of(*plate, box, p, s.report.spacing, 0)) {
    if (!cells[h.particle].bent && !cells[h.particle].open) continue;
    ++seen;
    for (std::size_t i = 0; i < p.size(); ++i) {
      const Vec3 d = p.position(i) - h.center, m = p.normal(i);
      if (same_sheet(h.normal.x(), h.normal.y(), h.normal.z(), m.x(), m.y(), m.z()) > 0)
        EXPECT_GE(d.norm() * arc_over_chord(d, h.normal, m), (h.radius - 1e-9) * s.report.spacing);
    }
  }
  EXPECT_GT(seen, 50);
}

}  // namespace
}  // namespace meniscus::sample
