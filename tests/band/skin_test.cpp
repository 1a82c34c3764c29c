#include "support.h"
#include "support/colliding_drops.h"

#include <meniscus/band/skin.h>
#include <meniscus/base/error.h>
#include <meniscus/base/random.h>

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <thread>

namespace meniscus::band {
namespace {

using test::fingerprint;

/// A ball filled with particles one apart, shaken; they move with `velocity`.
void add_drop(points::Cloud& cloud, const Vec3& center, double radius, const Vec3& velocity, double scale,
              std::uint64_t shake) {
  std::vector<double> v(cloud.attributes.values("v", 3).begin(), cloud.attributes.values("v", 3).end());
  std::vector<std::int64_t> id(cloud.attributes.integers("id").begin(), cloud.attributes.integers("id").end());
  const int n = static_cast<int>(radius) + 1;
  for (int i = -n; i <= n; ++i)
    for (int j = -n; j <= n; ++j)
      for (int k = -n; k <= n; ++k) {
        if (Vec3(i, j, k).norm() > radius) continue;
        const auto u = random_uniform(7, id.size(), shake);
        cloud.positions.push_back(scale * (center + Vec3(i, j, k) + 0.3 * Vec3(u[0] - 0.5, u[1] - 0.5, u[2] - 0.5)));
        for (int a = 0; a < 3; ++a) v.push_back(scale * velocity[a]);
        id.push_back(static_cast<std::int64_t>(id.size()));
      }
  cloud.attributes.set("v", 3, std::move(v));
  cloud.attributes.set_integers("id", 1, std::move(id));
}

/// Two drops on their way into one another, shaken anew every frame.
points::Cloud colliding(int frame, double scale = 1) {
  const double gone = std::min(0.5 * frame, 6.0);
  points::Cloud cloud;
  add_drop(cloud, {-7 + gone, 0.2, 0}, 5, {0.5, 0, 0}, scale, static_cast<std::uint64_t>(frame));
  add_drop(cloud, {7 - gone, 0, 0.1}, 4, {-0.5, 0, 0}, scale, static_cast<std::uint64_t>(frame));
  return cloud;
}

SkinOptions settings(double scale = 1) {
  SkinOptions o;
  o.radius = 0.75 * scale;
  o.voxel = 0.5 * scale;
  return o;
}

TEST(Skin, IsCalmAndKeepsVolumeThroughAMerge) {
  Skin skin(settings());
  double flicker = 0, worst = 0, volume = 0;
  std::size_t parts = 0;
  const int frames = 20;
  for (int f = 0; f < frames; ++f) {
    const SkinReport r = skin.advance(colliding(f), 1);
    if (f == 0) {
      volume = r.volume;
      EXPECT_EQ(r.components, 2u);
    }
    EXPECT_LE(r.max_courant, 0.5 + 1e-9);
    worst = std::max({worst, r.worst_volume_error, std::abs(r.volume / volume - 1)});
    flicker += f > 1 ? r.flicker / (frames - 2) : 0;
    parts = r.components;
  }
  EXPECT_EQ(parts, 1u);
  EXPECT_LT(worst, 0.005);
  EXPECT_LT(flicker, 0.15);
}

TEST(Skin, EveryComponentHoldsItsVolumeThroughACollision) {
  meniscus::test::CollidingDrops drops(3, 2.5, 0.12);
  Skin skin(settings());
  std::vector<double> start;
  std::size_t parts = 2;
  for (int f = 0; f < 30; ++f) {
    const SkinReport r = skin.advance(drops.cloud(), 1);
    EXPECT_LT(r.worst_volume_error, 0.005) << f;
    const std::vector<Component>& now = skin.components();
    if (f == 0)
      for (const Component& c : now) start.push_back(c.volume);
    ASSERT_EQ(start.size(), 2u);
    // Two for a while, one from then on: each holds what it began with, the merged one the sum.
    ASSERT_TRUE(now.size() == parts || now.size() == 1) << f;
    parts = now.size();
    if (parts == 1) {
      EXPECT_NEAR(now[0].volume / (start[0] + start[1]), 1, 0.005) << f;
    } else {
      for (int i = 0; i < 2; ++i) EXPECT_NEAR(now[i].volume / start[i], 1, 0.005) << f;
    }
    drops.advance();
  }
  EXPECT_EQ(parts, 1u);
}

TEST(Skin, VelocityOfADropInFlightIsItsOwn) {
  Skin skin(settings());
  const Vec3 velocity(0.8, -0.3, 0.4);
  for (int f = 0; f < 6; ++f) {
    points::Cloud cloud;
    add_drop(cloud, f * velocity, 5, velocity, 1, 0);
    skin.advance(cloud, 1);
  }
  const Crossings c = find_crossings(skin.band());
  std::vector<Vec3> x(c.size());
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = c.x.view()[i];
  const std::vector<Vec3> v = skin.velocities(x);
  double mean = 0;
  for (const Vec3& u : v) mean += (u - velocity).norm() / static_cast<double>(v.size());
  EXPECT_LT(mean, 0.05 * velocity.norm());
}

TEST(Skin, SameShapeAtAnyScale) {
  std::vector<double> relative;
  for (const double scale : {1.0, 0.01, 1000.0}) {
    Skin skin(settings(scale));
    SkinReport r;
    for (int f = 0; f < 3; ++f) r = skin.advance(colliding(f, scale), 1);
    relative.push_back(r.area / (scale * scale));
  }
  EXPECT_NEAR(relative[1] / relative[0], 1, 1e-4);
  EXPECT_NEAR(relative[2] / relative[0], 1, 1e-4);
}

TEST(Skin, SameBitsForAnyNumberOfThreads) {
  std::optional<std::uint64_t> first;
  for (const int threads : {1, 2, 3, 5, 8}) {
    RunOptions o;
    o.threads = threads;
    const RunControl run(o);
    Skin skin(settings());
    for (int f = 0; f < 3; ++f) skin.advance(colliding(f), 1, run);
    const std::uint64_t h = fingerprint(skin.band());
    EXPECT_EQ(h, first.value_or(h));
    first = h;
  }
}

TEST(Skin, SavedAndResumedIsUninterrupted) {
  Skin whole(settings());
  for (int f = 0; f < 6; ++f) whole.advance(colliding(f), 1);
  Skin first(settings());
  for (int f = 0; f < 3; ++f) first.advance(colliding(f), 1);
  Skin second(settings());
  second.resume(Band(first.band().grid()), first.state(), colliding(2), 1);
  for (int f = 3; f < 6; ++f) second.advance(colliding(f), 1);
  EXPECT_EQ(fingerprint(second.band()), fingerprint(whole.band()));
}

TEST(Skin, IsAsBeforeAfterAFrameThatWasCancelled) {
  // Cancelled earlier and later in the frame until it gets through; then all is as if it had never been tried.
  const auto frame = [](int f) {
    points::Cloud cloud = colliding(f);
    std::vector<std::size_t> keep;
    for (std::size_t i = 0; i < cloud.size(); ++i)
      if (f < 3 || i % 5 != 0) keep.push_back(i);  // some go: volumes are owed
    return points::gathered(cloud, keep);
  };
  Skin calm(settings()), tried(settings());
  for (int f = 0; f < 4; ++f) calm.advance(frame(f), 1);
  for (int f = 0; f < 3; ++f) tried.advance(frame(f), 1);
  int cancelled = 0;
  for (auto wait = std::chrono::microseconds(200);; wait += std::chrono::microseconds(1000) + wait / 40) {
    const RunControl run;
    std::thread other([&] {
      std::this_thread::sleep_for(wait);
      run.cancel();
    });
    bool through = true;
    try {
      tried.advance(frame(3), 1, run);
    } catch (const Cancelled&) {
      through = false;
      ++cancelled;
    }
    other.join();
    if (through) break;
  }
  EXPECT_GT(cancelled, 0);
  EXPECT_EQ(fingerprint(tried.band()), fingerprint(calm.band()));
  for (int f = 4; f < 6; ++f) {
    const SkinReport a = tried.advance(frame(f), 1), b = calm.advance(frame(f), 1);
    EXPECT_EQ(fingerprint(tried.band()), fingerprint(calm.band()));
    EXPECT_EQ(a.flicker, b.flicker);
    EXPECT_EQ(a.velocity_residual, b.velocity_residual);
    EXPECT_EQ(a.volume_goal, b.volume_goal);
    EXPECT_EQ(a.matched, b.matched);
  }
}

TEST(Skin, AFirstFrameThatFailsLeavesNoSkin) {
  Skin skin(settings());
  const RunControl run;
  run.cancel();
  EXPECT_THROW(skin.start(colliding(0), 1, run), Cancelled);
  EXPECT_FALSE(skin.started());
  skin.advance(colliding(0), 1);
  const std::uint64_t was = fingerprint(skin.band());
  EXPECT_THROW(skin.start(colliding(3), 1, run), Cancelled);
  EXPECT_EQ(fingerprint(skin.band()), was);
}

/// The largest way, voxels, of the surface `to` from the surface `from`.
double largest_way(const Band& from, const Band& to) {
  double worst = 0;
  const Crossings c = find_crossings(to);
  for (std::size_t i = 0; i < c.size(); ++i) worst = std::max(worst, std::abs(from.sample(c.x.view()[i])));
  return worst / from.voxel();
}

TEST(Skin, ACoarserParticleSetEasesIn) {
  // From one frame to the next every second particle goes, and the others take over its liquid, or do not. The coating
  // jumps; the skin comes after by `follow` of that, and by half a voxel a frame when it holds less: in every frame that
  // follows.
  for (const bool same_liquid : {true, false}) {
    SkinOptions o = settings();
    o.surface.kernel = ParticleKernel::Blobs;
    Skin skin(o);
    points::Cloud cloud;
    add_drop(cloud, Vec3::Zero(), 6, Vec3::Zero(), 1, 1);
    std::vector<std::size_t> keep;
    for (std::size_t i = 0; i < cloud.size(); i += 2) keep.push_back(i);
    points::Cloud thin = points::gathered(cloud, keep);
    if (same_liquid) thin.attributes.set(attribute::kRadius, 1, std::vector<double>(thin.size(), std::cbrt(2.0) * o.radius));
    const auto coating = [&](const points::Cloud& c) {
      return ParticleSurface(particle_frame(c, o.radius).state, o.surface).band(*o.voxel);
    };
    const double jump = largest_way(coating(cloud), coating(thin));
    EXPECT_GT(jump, same_liquid ? 0.8 : 1.0);
    for (int f = 0; f < 4; ++f) skin.advance(cloud, 1);
    const double volume = skin.components().front().volume;
    for (int f = 0; f < 24; ++f) {
      const Band before = skin.band();
      skin.advance(thin, 1);
      EXPECT_LT(largest_way(before, skin.band()), o.follow * jump + (same_liquid ? 0 : 0.5))
          << same_liquid << ", frame " << f;
    }
    EXPECT_NEAR(skin.components().front().volume / volume, same_liquid ? 1 : 0.5, 0.005);
  }
}

TEST(Skin, ParticlesThatGoChangeTheVolumeOnlyFromWithin) {
  points::Cloud cloud;
  add_drop(cloud, Vec3::Zero(), 6, Vec3::Zero(), 1, 1);
  const std::size_t drop = cloud.size();
  std::vector<std::size_t> keep;
  for (std::size_t i = 0; i < drop; ++i) keep.push_back(i);
  for (std::size_t i = 0; i < drop / 4; ++i) {  // vapour, each on its own
    cloud.positions.push_back({20 + 4.0 * static_cast<double>(i % 8), 4.0 * static_cast<double>(i / 8), 0});
  }
  std::vector<double> v(3 * cloud.size(), 0.0);
  std::vector<std::int64_t> id;
  for (std::size_t i = 0; i < cloud.size(); ++i) id.push_back(static_cast<std::int64_t>(i));
  cloud.attributes.set("v", 3, v);
  cloud.attributes.set_integers("id", 1, id);
  SkinOptions o = settings();
  o.surface.min_neighbours = 3;
  Skin skin(o);
  for (int f = 0; f < 2; ++f) skin.advance(cloud, 1);
  const double volume = skin.components().front().volume;
  for (int f = 0; f < 4; ++f) skin.advance(points::gathered(cloud, keep), 1);
  EXPECT_NEAR(skin.components().front().volume / volume, 1, 0.005);
}

TEST(Skin, SurvivesDegenerateFrames) {
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  points::Cloud empty, one, together, broken, stray;
  one.positions = {{1, 2, 3}};
  together.positions.assign(100, Vec3(1, 2, 3));
  broken.positions = {{nan, 0, 0}, {0, inf, 0}, {1, 2, 3}, {1e30, 0, 0}};
  add_drop(stray, Vec3::Zero(), 4, Vec3::Zero(), 1, 0);
  stray.positions[0] = {1e7, 0, 0};
  const std::vector<points::Cloud> all = {empty, one, together, broken, stray, empty, stray, one};
  for (const auto kernel : {ParticleKernel::Blobs, ParticleKernel::Averaged, ParticleKernel::Anisotropic}) {
    SkinOptions o = settings();
    o.surface.kernel = kernel;
    Skin skin(o);
    for (const points::Cloud& c : all) {
      const SkinReport r = skin.advance(c, 1);
      EXPECT_TRUE(std::isfinite(r.volume));
      EXPECT_LT(skin.band().brick_count(), 2000u);
      for (const float v : skin.band().values()) ASSERT_TRUE(std::isfinite(v));
    }
  }
}

TEST(Skin, StraysMakeNoSurface) {
  points::Cloud cloud;
  add_drop(cloud, Vec3::Zero(), 4, Vec3::Zero(), 1, 0);
  cloud.positions[0] = {30, 0, 0};
  SkinOptions o = settings();
  o.surface.min_neighbours = 1;
  Skin skin(o);
  const SkinReport r = skin.advance(cloud, 1);
  EXPECT_EQ(r.strays, 1u);
  EXPECT_EQ(r.components, 1u);
}

TEST(Skin, KeepsDropletsThatTensionWouldEat) {
  points::Cloud cloud;
  cloud.positions = {{0, 0, 0}, {9, 0, 0}, {10.2, 0, 0}};  // one alone, and a pair
  SkinOptions o = settings();
  SkinOptions eaten = o;
  eaten.keep_droplets = false;
  Skin kept(o), bare(eaten);
  SkinReport with, without;
  for (int f = 0; f < 4; ++f) {
    for (Vec3& p : cloud.positions) p.y() += 0.3;
    with = kept.advance(cloud, 1);
    without = bare.advance(cloud, 1);
  }
  EXPECT_EQ(without.components, 0u);
  EXPECT_EQ(without.lost, 3u);
  ASSERT_EQ(with.components, 2u);
  EXPECT_EQ(with.lost, 0u);
  EXPECT_NEAR(test::radius_of(kept.components()[0].volume) / 0.75, 1, 0.1);
}

TEST(Skin, CountsParticlesTooSmallForTheGrid) {
  points::Cloud cloud;
  for (int i = 0; i < 20; ++i) cloud.positions.emplace_back(1.37 * i, 0.2 * i, 0.11 * i);
  SkinOptions o = settings();
  o.radius = 0.05;  // a tenth of a voxel
  Skin skin(o);
  const SkinReport r = skin.start(cloud, 1);
  EXPECT_GT(r.lost, 15u);
  EXPECT_LE(r.lost, 20u);
}

TEST(Skin, ADropletMeetsTheBodyWithoutAJump) {
  // A single particle falls into a drop, a tenth of its radius a frame: the skin's volume changes no faster.
  Skin skin(settings());
  double last = 0, largest = 0;
  const double one = 4.0 / 3 * std::numbers::pi * std::pow(0.75, 3);
  for (int f = 0; f < 30; ++f) {
    points::Cloud cloud;
    add_drop(cloud, Vec3::Zero(), 4, Vec3::Zero(), 1, 1);
    add_drop(cloud, {8 - 0.075 * f, 0, 0}, 0.5, {-0.075, 0, 0}, 1, 1);
    const double volume = skin.advance(cloud, 1).volume;
    if (f > 0) largest = std::max(largest, std::abs(volume - last));
    last = volume;
  }
  EXPECT_LT(largest, 0.35 * one);
}

TEST(Skin, AnInnerShellIsAHardBound) {
  points::Cloud cloud;
  add_drop(cloud, Vec3::Zero(), 4, Vec3::Zero(), 1, 1);
  SkinOptions o = settings();
  o.tension = 2;
  o.shells.inner = 0.8;
  Skin skin(o);
  for (int f = 0; f < 3; ++f) skin.advance(cloud, 1);
  const Crossings c = find_crossings(skin.band());
  double nearest = o.radius;
  for (std::size_t i = 0; i < c.size(); ++i)
    for (const Vec3& p : cloud.positions) nearest = std::min(nearest, (c.x.view()[i] - p).norm());
  EXPECT_GT(nearest, 0.8 * o.radius - 0.2 * *o.voxel);
}

TEST(Skin, NothingStaysWhereNoParticleIs) {
  Skin skin(settings());
  points::Cloud two, one;
  add_drop(one, Vec3::Zero(), 4, Vec3::Zero(), 1, 1);
  two = one;
  add_drop(two, Vec3(14, 0, 0), 3, Vec3::Zero(), 1, 1);
  EXPECT_EQ(skin.advance(two, 1).components, 2u);
  SkinReport r;
  for (int f = 0; f < 4; ++f) r = skin.advance(one, 1);
  EXPECT_EQ(r.components, 1u);
}

TEST(Skin, RefusesWhatMakesNoSense) {
  EXPECT_THROW(Skin(SkinOptions{}), InvalidInput);
  SkinOptions o = settings();
  o.voxel = -1;
  EXPECT_THROW(Skin{o}, InvalidInput);
  o.voxel = 1e-4;
  Skin tiny(o);
  EXPECT_THROW(tiny.advance(colliding(0), 1), ResourceLimit);
  EXPECT_THROW(Skin(settings()).advance(colliding(0), 0), InvalidInput);
}

}  // namespace
}  // namespace meniscus::band
