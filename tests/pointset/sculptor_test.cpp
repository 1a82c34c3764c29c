#include <meniscus/pointset/sculptor.h>

#include <meniscus/base/error.h>
#include <meniscus/points/spacing.h>

#include "clouds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace meniscus::pointset {
namespace {

using Tool = Stroke::Tool;

Stroke stroke(Tool tool, const Vec3& place, double radius, double strength) {
  Stroke s;
  s.tool = tool;
  s.path = {place};
  s.radius = radius;
  s.strength = strength;
  s.voxels = 24;
  s.steps = 6;
  if (tool == Tool::Drag) s.direction = Vec3(1, 0, 0);
  return s;
}

/// One of every tool.
std::vector<Stroke> strokes(double scale = 1) {
  const Vec3 top(0, 0, scale);
  std::vector<Stroke> all;
  for (const Tool tool : {Tool::Force, Tool::Inflate, Tool::Smooth, Tool::Flatten, Tool::Crease, Tool::Drag}) {
    const bool share = tool == Tool::Smooth || tool == Tool::Flatten;
    all.push_back(stroke(tool, top, 0.5 * scale, share ? 1 : 0.15 * scale));
  }
  return all;
}

/// One of every tool, emboss and refine too.
std::vector<Stroke> every_stroke() {
  std::vector<Stroke> all = strokes();
  Stroke emboss;
  emboss.tool = Tool::Emboss;
  emboss.strength = 0.05;
  emboss.image = std::make_shared<GreyImage>(GreyImage{2, 2, {0, 1, 1, 0}});
  emboss.projection.width = emboss.projection.height = 1;
  all.push_back(emboss);
  Stroke refine = stroke(Tool::Refine, Vec3(0, 0, 1), 0.5, 1);
  refine.spacing = 0.04;
  all.push_back(refine);
  return all;
}

bool same(const PointSet& a, const PointSet& b) {
  return a.x == b.x && a.y == b.y && a.z == b.z && a.nx == b.nx && a.ny == b.ny && a.nz == b.nz && a.reach == b.reach &&
         a.bx == b.bx && a.by == b.by && a.bz == b.bz && a.coefficients == b.coefficients;
}

/// Height of the surface over the origin along `direction`, by bisection between half and twice the sphere's radius.
double height(const Sculptor& sculptor, const Vec3& direction) {
  double low = 0.7, high = 1.6;
  for (int k = 0; k < 50; ++k) {
    const double middle = 0.5 * (low + high);
    (field::value_at(sculptor.field(), middle * direction.normalized()) < 0 ? low : high) = middle;
  }
  return low;
}

/// Distances to the nearest other point, over the spacing at the start: least and greatest.
std::pair<double, double> spacings(const Sculptor& sculptor) {
  const auto places = positions(sculptor.set());
  const auto lists = points::nearest_neighbours(places, 1);
  double least = 1e300, greatest = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double d = (places[lists.of(i)[0]] - places[i]).norm() / sculptor.spacing();
    least = std::min(least, d);
    greatest = std::max(greatest, d);
  }
  return {least, greatest};
}

TEST(Sculptor, InflateRaisesTheSurfaceByItsStrengthUnderTheTool) {
  Sculptor sculptor(fit(test::sphere(4000)));
  for (const double strength : {0.2, -0.1}) {
    const double before = height(sculptor, Vec3(0, 0, 1));
    sculptor.apply(stroke(Tool::Inflate, before * Vec3(0, 0, 1), 0.6, strength));
    // The weight at the moving surface is below 1 where it has left the tool's middle.
    const double rise = height(sculptor, Vec3(0, 0, 1)) - before;
    EXPECT_LT(rise / strength, 1.01);
    EXPECT_GT(rise / strength, 0.6);
    EXPECT_NEAR(height(sculptor, Vec3(0, 1, -1)), 1, 1e-3);
  }
}

TEST(Sculptor, ForcePullsOutwardsAlongTheNormalAndPushesIn) {
  for (const double strength : {0.15, -0.15}) {
    Sculptor sculptor(fit(test::sphere(4000)));
    const StrokeReport report = sculptor.apply(stroke(Tool::Force, Vec3(0, 0, 1), 0.5, strength));
    EXPECT_GT(report.voxels, 10'000u);
    EXPECT_EQ(report.lost, 0u);
    const double rise = height(sculptor, Vec3(0, 0, 1)) - 1;
    EXPECT_GT(rise / strength, 0.5);
    EXPECT_LT(rise / strength, 1.05);
  }
}

TEST(Sculptor, ForceWithADirectionActsWhereTheSurfaceFacesIt) {
  Sculptor sculptor(fit(test::sphere(4000)));
  Stroke s = stroke(Tool::Force, Vec3(0, 0, 1), 0.5, 0.1);
  s.direction = Vec3(0, 0, -2);
  sculptor.apply(s);
  EXPECT_LT(height(sculptor, Vec3(0, 0, 1)), 0.96);
}

TEST(Sculptor, FlattenMakesAPlane) {
  Sculptor sculptor(fit(test::sphere(4000)));
  Stroke s = stroke(Tool::Flatten, Vec3(0, 0, 1), 0.6, 1);
  s.falloff.kind = Falloff::Kind::Constant;
  sculptor.apply(s);
  double low = 1e300, high = -1e300;
  for (std::size_t i = 0; i < sculptor.set().size(); ++i) {
    const Vec3 p = sculptor.set().position(i);
    if (p.z() < 0 || p.head<2>().norm() > 0.3) continue;
    low = std::min(low, p.z());
    high = std::max(high, p.z());
    EXPECT_GT(sculptor.set().normal(i).z(), 0.99);
  }
  EXPECT_LT(high - low, 0.01);  // the cap was 0.046 high
}

TEST(Sculptor, SmoothTakesARidgeAway) {
  Sculptor sculptor(fit(test::sphere(4000)));
  sculptor.apply(stroke(Tool::Inflate, Vec3(0, 0, 1), 0.2, 0.05));
  const double bump = height(sculptor, Vec3(0, 0, 1)) - 1;
  for (int k = 0; k < 3; ++k) sculptor.apply(stroke(Tool::Smooth, Vec3(0, 0, 1), 0.6, 1));
  EXPECT_LT(height(sculptor, Vec3(0, 0, 1)) - 1, 0.5 * bump);
}

TEST(Sculptor, DragCarriesAPointAlong) {
  points::Cloud cloud = test::sphere(4000);
  std::vector<std::int64_t> ids(4000);
  for (std::size_t i = 0; i < 4000; ++i) ids[i] = static_cast<std::int64_t>(i);
  cloud.attributes.set_integers(attribute::kId, 1, ids);
  Sculptor sculptor(fit(cloud));
  const Vec3 before = sculptor.set().position(0);  // at the top
  Stroke s = stroke(Tool::Drag, before, 0.5, 0.2);
  s.direction = Vec3(1, 0, 1);
  sculptor.apply(s);
  const auto kept = sculptor.set().attributes.integers(attribute::kId);
  ASSERT_EQ(kept[0], 0);
  EXPECT_LT((sculptor.set().position(0) - before - 0.2 * Vec3(1, 0, 1).normalized()).norm(), 0.03);
  std::vector<std::int64_t> unique(kept.begin(), kept.end());
  std::sort(unique.begin(), unique.end());
  EXPECT_EQ(std::adjacent_find(unique.begin(), unique.end()), unique.end());
}

TEST(Sculptor, EveryToolUndoesAndRedoesToTheBitAndLeavesTheRestAlone) {
  const PointSet start = fit(test::sphere(3000));
  for (const Stroke& s : strokes()) {
    Sculptor sculptor(start);
    const StrokeReport report = sculptor.apply(s);
    EXPECT_GT(report.moved, 50u) << name_of(s.tool);
    const PointSet after = sculptor.set();
    EXPECT_FALSE(same(start, after)) << name_of(s.tool);
    for (std::size_t i = 0; i < start.size(); ++i)
      if (start.z[i] < -0.2) ASSERT_EQ(start.position(i), after.position(i)) << name_of(s.tool);
    EXPECT_TRUE(sculptor.undo());
    EXPECT_TRUE(same(start, sculptor.set())) << name_of(s.tool);
    EXPECT_TRUE(sculptor.redo());
    EXPECT_TRUE(same(after, sculptor.set())) << name_of(s.tool);
    EXPECT_FALSE(sculptor.redo());
  }
}

TEST(Sculptor, EveryToolInARowIsTakenBackToTheBitStrokeByStroke) {
  Sculptor sculptor(fit(test::sphere(2000)));
  std::vector<PointSet> states{sculptor.set()};
  for (const Stroke& s : every_stroke()) {
    sculptor.apply(s);
    states.push_back(sculptor.set());
  }
  for (std::size_t k = states.size() - 1; k-- > 0;) {
    ASSERT_TRUE(sculptor.undo());
    EXPECT_TRUE(same(sculptor.set(), states[k])) << k;
  }
  EXPECT_FALSE(sculptor.undo());
  for (std::size_t k = 1; k < states.size(); ++k) {
    ASSERT_TRUE(sculptor.redo());
    EXPECT_TRUE(same(sculptor.set(), states[k])) << k;
  }
}

TEST(Sculptor, ActsAlikeAtAnyScale) {
  for (const double scale : {0.01, 1000.0}) {
    const auto small = strokes(), large = strokes(scale);
    for (std::size_t k = 0; k < small.size(); ++k) {
      Sculptor one(fit(test::sphere(1500))), other(fit(test::sphere(1500, scale)));
      one.apply(small[k]);
      other.apply(large[k]);
      ASSERT_EQ(one.set().size(), other.set().size()) << name_of(small[k].tool);
      double worst = 0;
      for (std::size_t i = 0; i < one.set().size(); ++i)
        worst = std::max(worst, (one.set().position(i) - other.set().position(i) / scale).norm());
      EXPECT_LT(worst, 1e-3) << name_of(small[k].tool);
    }
  }
}

TEST(Sculptor, SameBitsForAnyNumberOfThreads) {
  const auto run = [](int threads) {
    RunOptions o;
    o.threads = threads;
    Sculptor sculptor(fit(test::sphere(1500)));
    for (const Stroke& s : strokes()) sculptor.apply(s, RunControl(o));
    return sculptor.set();
  };
  const PointSet expected = run(1);
  for (const int threads : {2, 3, 5, 8}) EXPECT_TRUE(same(run(threads), expected)) << threads;
}

TEST(Sculptor, MirroredStrokesAreMirrored) {
  // A cloud that is its own mirror image at x = 0.
  points::Cloud half = test::sphere(3000);
  std::vector<Vec3> places, normals;
  for (const Vec3& p : half.positions)
    if (p.x() > 0.01) places.push_back(p), places.push_back(p.cwiseProduct(Vec3(-1, 1, 1)));
  Sculptor sculptor(fit(test::cloud_of(places, places)));
  Stroke s = stroke(Tool::Inflate, Vec3(0.8, 0, 0.6), 0.3, 0.1);
  s.mirror = {true, false, false};
  sculptor.apply(s);
  const double right = height(sculptor, Vec3(0.8, 0, 0.6)), left = height(sculptor, Vec3(-0.8, 0, 0.6));
  EXPECT_GT(right, 1.05);
  EXPECT_NEAR(right, left, 1e-3);
}

TEST(Sculptor, InsertsWhereTheSurfaceStretchesAndKeepsTheSpacing) {
  Sculptor sculptor(fit(test::sphere(3000)));
  for (int k = 0; k < 6; ++k) sculptor.apply(stroke(Tool::Force, (1 + 0.15 * k) * Vec3(0, 0, 1), 0.4, 0.2));
  EXPECT_GT(height(sculptor, Vec3(0, 0, 1)), 1.4);
  EXPECT_GT(sculptor.set().size(), 3100u);
  const auto [least, greatest] = spacings(sculptor);
  EXPECT_GT(least, 0.49);
  EXPECT_LT(greatest, 2);
}

TEST(Sculptor, RefineBringsANewSpacingEvenAtABorder) {
  points::Cloud cloud = test::sphere(1000);
  std::vector<std::size_t> upper;
  for (std::size_t i = 0; i < cloud.size(); ++i)
    if (cloud.positions[i].z() > 0.1) upper.push_back(i);
  Sculptor sculptor(fit(points::gathered(cloud, upper)));
  Stroke s;
  s.tool = Tool::Refine;
  s.spacing = 0.5 * sculptor.spacing();
  sculptor.apply(s);
  EXPECT_GT(sculptor.set().size(), 1300u);
  EXPECT_LT(sculptor.set().size(), 2500u);
  for (std::size_t i = 0; i < sculptor.set().size(); ++i) {
    EXPECT_NEAR(sculptor.set().position(i).norm(), 1, 2e-3);
    EXPECT_GT(sculptor.set().z[i], 0.05);  // the border has not grown
  }
  sculptor.undo();
  EXPECT_EQ(sculptor.set().size(), upper.size());
  EXPECT_GT(sculptor.spacing(), 1.5 * s.spacing);
}

TEST(Sculptor, EmbossRaisesWhatIsBright) {
  const auto image = std::make_shared<GreyImage>(GreyImage{40, 40, std::vector<float>(1600, 0.0F)});
  for (std::size_t y = 10; y < 30; ++y)
    for (std::size_t x = 10; x < 30; ++x) image->values[y * 40 + x] = 1;
  for (const double strength : {0.06, -0.06}) {
    Sculptor sculptor(fit(test::sphere(6000)));
    Stroke s;
    s.tool = Tool::Emboss;
    s.strength = strength;
    s.image = image;
    s.projection.width = s.projection.height = 1;
    sculptor.apply(s);
    EXPECT_NEAR(height(sculptor, Vec3(0, 0, 1)), 1 + strength, 0.1 * std::abs(strength));
    EXPECT_NEAR(height(sculptor, Vec3(0.4, 0, 0.9)), 1, 2e-3);
    EXPECT_NEAR(height(sculptor, Vec3(0, 0, -1)), 1, 1e-3);  // faces away
  }
}

TEST(Sculptor, SheetsThatMeetBecomeOneOrVanish) {
  // Pushed through from both sides, a plate gets a hole: points in its middle vanish.
  Sculptor sculptor(fit(test::plate(1, 0.08, 0.025)));
  Stroke s = stroke(Tool::Inflate, Vec3(0, 0, 0), 0.25, -0.06);
  s.falloff.kind = Falloff::Kind::Constant;
  const StrokeReport report = sculptor.apply(s);
  EXPECT_GT(report.lost, 50u);
  for (std::size_t i = 0; i < sculptor.set().size(); ++i) EXPECT_GT(sculptor.set().position(i).norm(), 0.1);
  EXPECT_TRUE(sculptor.undo());
}

TEST(Sculptor, FailedStrokesLeaveTheSetAsItWas) {
  const PointSet start = fit(test::sphere(500));
  Sculptor sculptor(start);
  EXPECT_THROW(sculptor.apply(stroke(Tool::Inflate, Vec3(0, 0, 0), 3, -1.5)), InvalidInput);  // nothing would be left
  EXPECT_TRUE(same(start, sculptor.set()));
  EXPECT_EQ(sculptor.strokes_done(), 0u);
  RunControl cancelled;
  cancelled.cancel();
  EXPECT_THROW(sculptor.apply(stroke(Tool::Inflate, Vec3(0, 0, 1), 0.5, 0.1), cancelled), Cancelled);
  EXPECT_TRUE(same(start, sculptor.set()));
  const StrokeReport beside = sculptor.apply(stroke(Tool::Force, Vec3(9, 9, 9), 0.5, 0.1));
  EXPECT_EQ(beside.moved, 0u);
  EXPECT_TRUE(same(start, sculptor.set()));
}

}  // namespace
}  // namespace meniscus::pointset
