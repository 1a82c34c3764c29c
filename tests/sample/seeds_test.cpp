#include <meniscus/base/random.h>
#include <meniscus/sample/seeds.h>

#include "surfaces.h"

#include <gtest/gtest.h>

namespace meniscus::sample {
namespace {

/// Spheres on a coarse lattice, radii from 0.3 down to 0.3/40, so that none touches another.
struct Spheres {
  std::vector<Vec3> centers;
  std::vector<double> radii;
  std::unique_ptr<field::Field> field;
  Box box;

  Spheres(std::size_t n, double scale) {
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3 cell(static_cast<double>(i % 4), static_cast<double>(i / 4 % 4), static_cast<double>(i / 16));
      const auto u = random_uniform(11, i, 0);
      centers.push_back(scale * (cell + 0.1 * Vec3(u[0], u[1], u[2])));
      radii.push_back(scale * 0.3 *
                      std::pow(40.0, -static_cast<double>(i) / static_cast<double>(std::max<std::size_t>(n - 1, 1))));
    }
    field = field::particles(centers, radii);
    box = Box{scale * Vec3::Constant(-0.7), scale * Vec3(3.8, 3.8, 3.8)};
  }
};

TEST(Seeds, HitEveryComponentOfVeryDifferentSizes) {
  for (const double scale : {0.01, 1.0, 1000.0})
    for (const std::size_t n : {1u, 2u, 7u, 50u}) {
      const Spheres s(n, scale);
      const Seeds seeds =
          find_seeds(*s.field, s.box, {.resolution = s.box.size().maxCoeff() / 64, .tolerance = 1e-9 * scale});
      std::vector<int> hits(n, 0);
      for (std::size_t k = 0; k < seeds.points.size(); ++k)
        for (std::size_t i = 0; i < n; ++i) {
          const double distance = std::abs((seeds.points.position(k) - s.centers[i]).norm() - s.radii[i]);
          if (distance < 1e-6 * s.radii[i]) ++hits[i];
        }
      for (std::size_t i = 0; i < n; ++i)
        EXPECT_GT(hits[i], 0) << "sphere " << i << " of " << n << ", radius " << s.radii[i];
    }
}

TEST(Seeds, WithoutBoundsTheSignIsSampled) {
  const auto gyroid = test::gyroid();
  const Box box = Box::around(Vec3::Zero(), 1);
  const Seeds seeds = find_seeds(*gyroid, box, {.resolution = 2.0 / 32, .tolerance = 1e-9});
  EXPECT_GT(seeds.points.size(), 500u);
  for (std::size_t i = 0; i < seeds.points.size(); ++i) EXPECT_TRUE(box.contains(seeds.points.position(i)));
}

TEST(Seeds, NoSurfaceGivesNone) {
  const auto sphere = test::sphere();
  EXPECT_TRUE(find_seeds(*sphere, Box::around(Vec3(5, 0, 0), 1), {.resolution = 0.1, .tolerance = 1e-9}).points.empty());
}

TEST(Seeds, NanIsCountedNotFollowed) {
  const test::FunctionField nan(
      [](const Vec3&, double) { return test::FunctionField::Jet{.f = std::nan(""), .g = Vec3::Constant(std::nan(""))}; });
  const Seeds seeds =
      find_seeds(nan, Box::around(Vec3::Zero(), 1), {.resolution = 0.25, .refinements = 0, .tolerance = 1e-9});
  EXPECT_TRUE(seeds.points.empty());
  EXPECT_GT(seeds.not_finite, 0u);
}

}  // namespace
}  // namespace meniscus::sample
