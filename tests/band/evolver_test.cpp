#include "support.h"

#include <meniscus/band/evolver.h>
#include <meniscus/base/error.h>

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::band {
namespace {

using test::ball;
using test::fingerprint;
using test::radius_of;
using test::total_volume;

/// A speed that is the same everywhere.
class Constant final : public Strategy {
 public:
  explicit Constant(double v) : v_(v) {}
  std::string name() const override { return "constant"; }
  void add_speed(const SurfaceSamples&, std::span<double> speed, const RunControl&) override {
    for (double& s : speed) s += v_;
  }

 private:
  double v_;
};

EvolverOptions with_tension(double beta) {
  EvolverOptions o;
  o.tension = beta;
  return o;
}

TEST(Tension, ASphereShrinksAsItShould) {
  for (const double scale : {1.0, 0.01, 1000.0}) {
    // R² = R₀² - 4βt.
    const double start = scale == 1 ? 40 : 20;
    Evolver skin(ball(scale, Vec3(0.3, 0.2, 0.1) * scale, start * scale), with_tension(scale * scale));
    double time = 0;
    for (const double radius : {30.0, 20.0, 14.0, 10.0}) {
      if (radius >= start) continue;
      const double before = radius_of(total_volume(skin.band())) / scale;
      const double until = (start * start - radius * radius) / 4;
      skin.advance(time, until - time, 2.0);
      const double after = radius_of(total_volume(skin.band())) / scale;
      const double rate = (before * before - after * after) / (until - time);
      EXPECT_NEAR(rate / 4, 1, 0.02);
      time = until;
    }
  }
}

TEST(Tension, ManyStagesGiveWhatSmallStepsGive) {
  Evolver fine(ball(1, Vec3::Zero(), 15), with_tension(1));
  Evolver coarse(ball(1, Vec3::Zero(), 15), with_tension(1));
  const auto small = fine.advance(0, 10, 0.15);
  const auto large = coarse.advance(0, 10, 5);
  EXPECT_NEAR(radius_of(total_volume(fine.band())), radius_of(total_volume(coarse.band())), 0.05);
  EXPECT_LT(large.tension_stages, small.tension_stages / 2);
}

TEST(Transport, AFrontMovesByItsSpeed) {
  Evolver skin(ball(1, Vec3(0.1, 0.2, 0.3), 12), {});
  skin.add(std::make_shared<Constant>(2.0));
  const auto report = skin.advance(0, 5);
  EXPECT_LE(report.max_courant, 0.5 + 1e-9);
  EXPECT_NEAR(radius_of(total_volume(skin.band())), 22, 0.05);
}

TEST(Transport, TheSideStaysKnownAfterALongWay) {
  Evolver skin(ball(1, Vec3::Zero(), 8), {});
  skin.add(std::make_shared<Constant>(1.0));
  skin.advance(0, 40);
  const Band& band = skin.band();
  for (std::size_t b = 0; b < band.brick_count(); ++b)
    for (int d = 0; d < 27; ++d) {
      const std::int32_t n = band.neighbours(b)[static_cast<std::size_t>(d)];
      const double r = (band.position(b, 4, 4, 4) + 8.0 * Vec3(d / 9 - 1, d / 3 % 3 - 1, d % 3 - 1)).norm();
      if (n < 0) EXPECT_EQ(n, r < 48 ? Band::kInside : Band::kOutside);
    }
}

TEST(Transport, ASurfaceMayVanish) {
  Evolver skin(ball(1, Vec3::Zero(), 6), {});
  skin.add(std::make_shared<Constant>(-1.0));
  skin.advance(0, 12);
  EXPECT_TRUE(skin.band().empty());
  EXPECT_NO_THROW(skin.advance(12, 1));
}

TEST(Target, ConvergesToItsSurfaceAndRests) {
  const auto torus = field::torus({0, 0, 0}, {0, 1, 0}, 14, 6);
  Evolver skin(ball(1, Vec3(14, 0, 0), 5), {});
  skin.add(std::make_shared<Target>(*torus, 1.0, 3.0));
  skin.advance(0, 40);
  const Crossings c = find_crossings(skin.band());
  double worst = 0;
  for (std::size_t i = 0; i < c.size(); ++i) worst = std::max(worst, std::abs(field::value_at(*torus, c.x.view()[i])));
  EXPECT_LT(worst, 0.1);  // voxels
  // The whole torus is covered, and nothing else.
  EXPECT_NEAR(total_volume(skin.band()) / (2 * std::numbers::pi * std::numbers::pi * 14 * 36), 1, 0.02);

  const Crossings before = find_crossings(skin.band());
  skin.advance(40, 1);  // a frame
  const Crossings after = find_crossings(skin.band());
  ASSERT_EQ(before.size(), after.size());
  double moved = 0;
  for (std::size_t i = 0; i < c.size(); ++i) moved = std::max(moved, (before.x.view()[i] - after.x.view()[i]).norm());
  EXPECT_LT(moved, 1e-3);
}

TEST(Volume, IsHeldPerComponentThroughAMerge) {
  // Two balls are pulled into one by a target that grows between them; their volumes add up.
  const auto bridge = field::capsule({-12, 0, 0}, {12, 0, 0}, 9);
  const auto left = field::sphere({-13, 0, 0}, 10), right = field::sphere({13, 0, 0}, 8);
  const Band a = band_of(*left, 1), b = band_of(*right, 1);
  std::vector<Coord> bricks = a.bricks();
  std::vector<float> values(a.values().begin(), a.values().end());
  for (std::size_t i = 0; i < b.brick_count(); ++i) {
    const std::int32_t at = a.find(b.bricks()[i]);
    if (at < 0) {
      bricks.push_back(b.bricks()[i]);
      values.insert(values.end(), b.values().begin() + static_cast<std::ptrdiff_t>(i * 512),
                    b.values().begin() + static_cast<std::ptrdiff_t>(i * 512 + 512));
    } else {
      for (std::size_t n = 0; n < 512; ++n) {
        float& v = values[static_cast<std::size_t>(at) * 512 + n];
        v = std::min(v, b.values()[i * 512 + n]);
      }
    }
  }
  Evolver skin(Band(1, Vec3::Zero(), bricks, values), with_tension(0.2));
  skin.hold_present_volumes(true);
  ASSERT_EQ(skin.components().size(), 2u);
  const double sum = *skin.components()[0].goal + *skin.components()[1].goal;
  skin.add(std::make_shared<Target>(*bridge, 0.3, 3.0));
  skin.add(std::make_shared<HoldVolume>());
  double worst = 0;
  std::size_t fewest = 2;
  for (int frame = 0; frame < 40; ++frame) {
    skin.advance(frame * 0.5, 0.5);
    skin.settle_volumes();
    for (const Component& c : skin.components()) {
      ASSERT_TRUE(c.goal.has_value());
      worst = std::max(worst, std::abs(c.volume / *c.goal - 1));
    }
    fewest = std::min(fewest, skin.components().size());
  }
  EXPECT_EQ(fewest, 1u);
  double goal = 0;
  for (const Component& c : skin.components()) goal += *c.goal;
  EXPECT_NEAR(goal / sum, 1, 1e-9);
  EXPECT_LT(worst, 0.005);
}

TEST(Evolver, SameBitsForAnyNumberOfThreads) {
  const auto torus = field::torus({0, 0, 0}, {0, 1, 0}, 10, 4);
  std::optional<std::uint64_t> first;
  for (const int threads : {1, 2, 3, 5, 8}) {
    RunOptions o;
    o.threads = threads;
    const RunControl run(o);
    Evolver skin(ball(1, Vec3(10, 0, 0), 3), with_tension(0.3));
    skin.hold_present_volumes(true, run);
    skin.add(std::make_shared<Target>(*torus, 1.0, 3.0));
    skin.add(std::make_shared<HoldVolume>());
    skin.advance(0, 4, 0.5, run);
    const std::uint64_t h = fingerprint(skin.band());
    EXPECT_EQ(h, first.value_or(h));
    first = h;
  }
}

TEST(Evolver, ASpeedThatIsNotFiniteFailsAndLeavesTheSurface) {
  for (const double bad : {std::nan(""), HUGE_VAL}) {
    Evolver skin(ball(1, Vec3::Zero(), 8), {});
    const std::uint64_t before = fingerprint(skin.band());
    skin.add(std::make_shared<Constant>(bad));
    EXPECT_THROW(skin.advance(0, 1), Error);
    EXPECT_EQ(fingerprint(skin.band()), before);
  }
}

TEST(Evolver, StepsAreBounded) {
  EvolverOptions o;
  o.max_steps = 10;
  Evolver skin(ball(1, Vec3::Zero(), 8), o);
  const std::uint64_t before = fingerprint(skin.band());
  skin.add(std::make_shared<Constant>(1e9));
  EXPECT_THROW(skin.advance(0, 1), Error);
  EXPECT_EQ(fingerprint(skin.band()), before);
}

TEST(Evolver, AfterRenewingOnlySamplesAndGoalsCount) {
  // Volumes that are settled leave a way behind, which must not decide when bricks of the next frame wake.
  for (const double change : {0.95, 0.9, 1.05, 1.1, 1.2}) {
    const auto alive = [](Band band) {
      Evolver e(std::move(band), with_tension(0.2));
      e.add(std::make_shared<Constant>(0.3));
      e.add(std::make_shared<HoldVolume>());
      return e;
    };
    Evolver whole = alive(ball(1, Vec3(0.3, 0.2, 0.1), 12));
    const auto goals = [&] {
      std::vector<std::optional<double>> out;
      for (const Component& c : whole.components()) out.push_back(c.goal);
      return out;
    };
    whole.hold_present_volumes(true);
    whole.set_goals({*goals()[0] * change});
    whole.settle_volumes();
    whole.renew(true);
    Evolver saved = alive(Band(whole.band().grid()));
    saved.set_goals(goals());
    for (Evolver* e : {&whole, &saved}) {
      e->clear_strategies();
      e->add(std::make_shared<Constant>(0.3));
      e->advance(0, 2, 0.25);
    }
    EXPECT_EQ(fingerprint(saved.band()), fingerprint(whole.band())) << change;
  }
}

TEST(Evolver, RenewingHoldsTheVolumeOfSmallDrops) {
  for (const double radius : {2.0, 2.5, 3.0, 4.0}) {
    Evolver drop(ball(1, Vec3(0.3, 0.2, 0.1), radius), with_tension(0));
    drop.hold_present_volumes(true);
    const double goal = *drop.components()[0].goal;
    drop.renew(true);
    EXPECT_NEAR(drop.components()[0].volume / goal, 1, 2e-5) << radius;
  }
}

}  // namespace
}  // namespace meniscus::band
