#include "support.h"

#include <meniscus/band/crossings.h>
#include <meniscus/band/kernels.h>
#include <meniscus/band/redistance.h>
#include <meniscus/base/error.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

namespace meniscus::band {
namespace {

using test::ball;

TEST(Band, MeasuresABallToSecondOrder) {
  const Band band = ball(1, {0.3, -0.2, 0.1}, 20);
  const Labels labels = label_components(band);
  const auto parts = measure_components(band, labels);
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_NEAR(parts[0].volume / (4.0 / 3 * std::numbers::pi * 8000), 1, 2e-3);
  EXPECT_NEAR(parts[0].area / (4 * std::numbers::pi * 400), 1, 2e-3);
}

TEST(Band, MemoryFollowsTheSurface) {
  const double small = static_cast<double>(ball(1, Vec3::Zero(), 20).brick_count());
  const double large = static_cast<double>(ball(1, Vec3::Zero(), 80).brick_count());
  EXPECT_LT(large / small, 18);  // area: 16, volume: 64
}

TEST(Band, SamplesAreDistancesEverywhereInTheBand) {
  const Band band = ball(0.01, {0.003, 0.004, 0.005}, 0.15);
  double worst = 0;
  for (std::size_t b = 0; b < band.brick_count(); ++b)
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < 8; ++j)
        for (int k = 0; k < 8; ++k) {
          const double d = (band.position(b, i, j, k) - Vec3(0.003, 0.004, 0.005)).norm() - 0.15;
          const double clamped = std::clamp<double>(d, -band.background(), band.background());
          const double f = band.values()[b * 512 + static_cast<std::size_t>((i * 8 + j) * 8 + k)];
          worst = std::max(worst, std::abs(f - clamped) / 0.01);
        }
  EXPECT_LT(worst, 0.02);  // voxels, R = 15 voxels
}

TEST(Band, TheSideIsKnownBeyondTheBricks) {
  const Band band = ball(1, Vec3::Zero(), 40);
  for (std::size_t b = 0; b < band.brick_count(); ++b)
    for (int dx = -1; dx <= 1; ++dx)
      for (int dy = -1; dy <= 1; ++dy)
        for (int dz = -1; dz <= 1; ++dz) {
          const std::int32_t n = band.neighbours(b)[Band::direction(dx, dy, dz)];
          if (n >= 0) continue;
          const double r = (band.position(b, 4, 4, 4) + 8.0 * Vec3(dx, dy, dz)).norm();
          EXPECT_EQ(n, r < 40 ? Band::kInside : Band::kOutside);
        }
}

TEST(Band, RefusesWhatMakesNoSense) {
  EXPECT_THROW(Band(0.0), InvalidInput);
  EXPECT_THROW(Band(1.0, Vec3::Zero(), {{0, 0, 0}}, std::vector<float>(3)), InvalidInput);
  EXPECT_THROW(Band(1.0, Vec3::Zero(), {{0, 0, 0}, {0, 0, 0}}, std::vector<float>(1024)), InvalidInput);
  const auto plane = field::plane({0, 0, 0}, {0, 1, 0});
  EXPECT_THROW(band_of(*plane, 1), InvalidInput);
  EXPECT_THROW(band_of(*field::sphere({0, 0, 0}, 100), 1, {}, 100), ResourceLimit);
}

TEST(Redistance, DoesNotMoveTheSurface) {
  // A ball whose samples are stretched by a factor that varies over the surface.
  Band band = ball(1, {0.2, 0.1, 0.4}, 20);
  std::vector<float> stretched(band.values().begin(), band.values().end());
  for (std::size_t b = 0; b < band.brick_count(); ++b)
    for (int n = 0; n < 512; ++n) {
      const Vec3 x = band.position(b, n >> 6, n >> 3 & 7, n & 7);
      stretched[b * 512 + static_cast<std::size_t>(n)] *= static_cast<float>(1.2 + 0.3 * std::sin(x.x() / 8));
    }
  band.swap_values(stretched);
  const Crossings before = find_crossings(band);
  redistance(band);
  const Crossings after = find_crossings(band);
  ASSERT_EQ(before.size(), after.size());
  double worst = 0, mean = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const double shift = (before.x.view()[i] - after.x.view()[i]).norm();
    worst = std::max(worst, shift);
    mean += shift / static_cast<double>(before.size());
  }
  EXPECT_LT(worst, 0.01);
  EXPECT_LT(mean, 0.002);
}

/// The step kernel as the formulas read, in double.
double slow_rate(const float* p, double speed, double tension) {
  const int strides[3] = {kHaloX, kHaloY, 1};
  const auto minmod = [](double a, double b) { return a * b <= 0 ? 0.0 : std::abs(a) < std::abs(b) ? a : b; };
  double godunov = 0;
  for (const int s : strides) {
    const double f[5] = {p[-2 * s], p[-s], p[0], p[s], p[2 * s]};
    const double left = f[2] - f[1] + 0.5 * minmod(f[2] - 2 * f[1] + f[0], f[3] - 2 * f[2] + f[1]);
    const double right = f[3] - f[2] - 0.5 * minmod(f[3] - 2 * f[2] + f[1], f[4] - 2 * f[3] + f[2]);
    const double l = speed > 0 ? std::max(left, 0.0) : std::min(left, 0.0);
    const double r = speed > 0 ? std::min(right, 0.0) : std::max(right, 0.0);
    godunov += std::max(l * l, r * r);
  }
  double g[3], h[3][3], square = 0;
  for (int a = 0; a < 3; ++a) {
    g[a] = 0.5 * (p[strides[a]] - p[-strides[a]]);
    square += g[a] * g[a];
    h[a][a] = p[strides[a]] - 2 * p[0] + p[-strides[a]];
    for (int b = 0; b < a; ++b)
      h[a][b] = h[b][a] = 0.25 * (p[strides[a] + strides[b]] - p[strides[a] - strides[b]] - p[strides[b] - strides[a]] +
                                  p[-strides[a] - strides[b]]);
  }
  double curvature = 0;  // [|∇f|² tr H - ∇fᵀ H ∇f] / |∇f|²
  for (int a = 0; a < 3; ++a) {
    curvature += square * h[a][a];
    for (int b = 0; b < 3; ++b) curvature -= g[a] * h[a][b] * g[b];
  }
  curvature /= square;
  return -speed * std::sqrt(godunov) + tension * curvature;
}

TEST(Kernels, StepAgreesWithTheFormulas) {
  const Band band = ball(1, {0.2, 0.1, 0.4}, 12);
  StepCoefficients c;
  c.tension = 0.3f;
  c.c = 0.1f;
  std::vector<float> out(512), baseline(512);
  Halo speed{};
  for (int n = 0; n < 512; ++n) speed[halo_at(n >> 6, n >> 3 & 7, n & 7)] = std::sin(0.37f * static_cast<float>(n));
  int compared = 0;
  for (std::size_t b = 0; b < band.brick_count(); ++b) {
    Halo halo{};
    gather_halo(band, band.values().data(), b, band.background(), -band.background(), halo);
    kernels().step(halo, speed, nullptr, c, kAllRows, out.data());
    baseline_kernels().step(halo, speed, nullptr, c, kAllRows, baseline.data());
    EXPECT_EQ(std::memcmp(out.data(), baseline.data(), out.size() * sizeof(float)), 0);
    for (int n = 0; n < 512; ++n) {
      const float* p = halo + halo_at(n >> 6, n >> 3 & 7, n & 7);
      if (std::abs(*p) > 1.5) continue;  // tension fades out near the rim
      const auto i = static_cast<std::size_t>(n);
      EXPECT_NEAR(out[i], *p + 0.1 * slow_rate(p, speed[halo_at(n >> 6, n >> 3 & 7, n & 7)], 0.3), 2e-6);
      ++compared;
    }
  }
  EXPECT_GT(compared, 3000);
}

}  // namespace
}  // namespace meniscus::band
