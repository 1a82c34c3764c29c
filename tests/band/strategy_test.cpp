#include "support.h"

#include <meniscus/band/evolver.h>
#include <meniscus/base/error.h>

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::band {
namespace {

using test::ball;
using test::radius_of;
using test::total_volume;

double total_area(const Band& band) {
  double a = 0;
  for (const Component& c : measure_components(band, label_components(band))) a += c.area;
  return a;
}

/// A user's own: wind that pushes what faces it.
class Wind final : public Strategy {
 public:
  std::string name() const override { return "wind"; }
  void add_speed(const SurfaceSamples& at, std::span<double> speed, const RunControl&) override {
    for (std::size_t i = 0; i < speed.size(); ++i) speed[i] += 2 * at.crossings.normal[i].x();
  }
};

TEST(Strategies, AUsersOwnMovesTheSurface) {
  EvolverOptions o;
  o.courant = 0.1;
  Evolver skin(ball(1, Vec3::Zero(), 10), o);
  skin.add(std::make_shared<Wind>());
  skin.advance(0, 3);
  const Crossings c = find_crossings(skin.band());
  double worst = 0;
  for (std::size_t i = 0; i < c.size(); ++i) worst = std::max(worst, std::abs((c.x.view()[i] - Vec3(6, 0, 0)).norm() - 10));
  EXPECT_LT(worst, 0.1);  // it is carried along as a whole
}

TEST(Strategies, AddUp) {
  // Twice the same wind is a wind of twice the speed.
  EvolverOptions o;
  o.courant = 0.1;
  Evolver skin(ball(1, Vec3::Zero(), 10), o);
  skin.add(std::make_shared<Wind>());
  skin.add(std::make_shared<Wind>());
  skin.advance(0, 1.5);
  const Crossings c = find_crossings(skin.band());
  double worst = 0;
  for (std::size_t i = 0; i < c.size(); ++i) worst = std::max(worst, std::abs((c.x.view()[i] - Vec3(6, 0, 0)).norm() - 10));
  EXPECT_LT(worst, 0.1);
}

TEST(Strategies, AreaIsBroughtToItsGoalAndHeldAgainstTension) {
  for (const double share : {0.8, 1.3}) {
    EvolverOptions o;
    o.tension = 0.05;
    Evolver skin(ball(1, Vec3(0.2, 0.1, 0), 12), o);
    const double goal = share * total_area(skin.band());
    skin.add(std::make_shared<HoldArea>(goal, 10.0));
    skin.advance(0, 12);  // in steps that the strategy allows
    EXPECT_NEAR(total_area(skin.band()) / goal, 1, 0.01);
  }
  EXPECT_THROW(HoldArea(0, 1), InvalidInput);
}

TEST(Strategies, VolumeIsHeldAgainstTension) {
  EvolverOptions o;
  o.tension = 0.5;
  Evolver skin(ball(1, Vec3::Zero(), 8), o);
  skin.hold_present_volumes(true);
  const double before = total_volume(skin.band());
  skin.add(std::make_shared<HoldVolume>());
  skin.advance(0, 20, 0.5);  // tension alone would shrink it to R = 4.9
  skin.settle_volumes();
  EXPECT_NEAR(total_volume(skin.band()) / before, 1, 0.005);
}

TEST(Strategies, ATargetPullsNoFasterThanItsReach) {
  const auto far = field::sphere({0, 0, 0}, 40);
  Evolver skin(ball(1, Vec3::Zero(), 8), {});
  skin.add(std::make_shared<Target>(*far, 0.5, 4.0));
  const AdvanceReport r = skin.advance(0, 2);
  EXPECT_DOUBLE_EQ(r.max_speed, 2);
  EXPECT_NEAR(radius_of(total_volume(skin.band())), 12, 0.05);
  EXPECT_THROW(Target(*far, 0, 1), InvalidInput);
}

}  // namespace
}  // namespace meniscus::band
