#include <meniscus/pointset/normals.h>

#include <meniscus/base/error.h>
#include <meniscus/base/random.h>

#include "clouds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

namespace meniscus::pointset {
namespace {

using test::degrees_between;
using test::normals_of;

struct Errors {
  double mean = 0;
  double worst = 0;
  std::size_t turned = 0;  // facing the wrong way
};

Errors errors(const points::Cloud& cloud, const std::function<Vec3(const Vec3&)>& truth) {
  Errors e;
  const std::vector<Vec3> normals = normals_of(cloud);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const double angle = degrees_between(normals[i], truth(cloud.positions[i]));
    e.turned += angle > 90;
    e.mean += angle / static_cast<double>(cloud.size());
    e.worst = std::max(e.worst, angle);
  }
  return e;
}

points::Cloud without_normals(points::Cloud cloud) {
  cloud.attributes.erase(attribute::kNormal);
  return cloud;
}

TEST(Normals, OfASphereAtAnyScaleAndPlace) {
  for (const double scale : {0.01, 1.0, 1000.0})
    for (const Vec3& center : {Vec3(0, 0, 0), Vec3(1e6 * scale, 0, 0)}) {
      points::Cloud cloud = without_normals(test::sphere(2000, scale, center));
      NormalReport report;
      const auto e = errors(with_normals(cloud, {}, &report), [&](const Vec3& p) { return (p - center).normalized(); });
      EXPECT_LT(e.mean, 1);
      EXPECT_LT(e.worst, 8);
      EXPECT_EQ(e.turned, 0u);
      EXPECT_EQ(report.estimated, 2000u);
      EXPECT_EQ(report.pieces, 1u);
      EXPECT_EQ(report.failed, 0u);
      EXPECT_EQ(report.outliers, 0u);
    }
}

TEST(Normals, OfATorusFaceOutInTheHoleToo) {
  NormalReport report;
  const auto cloud = with_normals(without_normals(test::torus(4000, 1, 0.3)), {}, &report);
  const auto e = errors(cloud, [](const Vec3& p) { return test::torus_normal(p, 1); });
  EXPECT_EQ(cloud.size(), 4000u);
  EXPECT_LT(e.mean, 2);
  EXPECT_EQ(e.turned, 0u);
  EXPECT_EQ(report.failed, 0u);
}

TEST(Normals, OfAThinPlateDifferBetweenItsSides) {
  // Sheets nearer to one another than four times the spacing of 0.025, so that neighbourhoods see both.
  for (const double thickness : {0.1, 0.06, 0.04}) {
    NormalReport report;
    const auto cloud = with_normals(without_normals(test::plate(1, thickness, 0.025)), {}, &report);
    std::size_t turned = 0, faces = 0;
    const auto normals = normals_of(cloud);
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const Vec3& p = cloud.positions[i];
      if (p.head<2>().cwiseAbs().maxCoeff() > 0.47) continue;  // the rim
      ++faces;
      turned += normals[i].z() * p.z() < 0.9 * std::abs(p.z());
    }
    EXPECT_GT(faces, 2000u);
    EXPECT_EQ(turned, 0u) << thickness;
    EXPECT_LT(report.failed, cloud.size() / 100);
  }
}

TEST(Normals, OfAThinPlateWithoutARimDifferBetweenItsSidesToo) {
  // Nothing but the edges of both sheets leads from side to side.
  points::Cloud plate = test::plate(1, 0.1, 0.05);
  std::vector<std::size_t> sides;
  for (std::size_t i = 0; i < plate.size(); ++i)
    if (std::abs(std::abs(plate.positions[i].z()) - 0.05) < 1e-9) sides.push_back(i);
  const points::Cloud cloud = points::gathered(without_normals(plate), sides);
  const auto normals = normals_of(with_normals(cloud));
  std::size_t turned = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) turned += normals[i].z() * cloud.positions[i].z() <= 0;
  EXPECT_LT(turned, cloud.size() / 50);
}

TEST(Normals, FollowTheOutsideRoundSharpEdges) {
  // Faces of a tetrahedron, whose normals stand 109 degrees apart, without points at the edges.
  const Vec3 corners[4] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  for (const int n : {12, 20, 30}) {
    points::Cloud cloud;
    std::vector<Vec3> truth;
    for (int face = 0; face < 4; ++face) {
      const Vec3 &a = corners[(face + 1) % 4], &b = corners[(face + 2) % 4], &c = corners[(face + 3) % 4];
      for (int i = 0; i < n; ++i)
        for (int j = 0; i + j < n; ++j) {
          const double u = (i + 1.0 / 3) / n, v = (j + 1.0 / 3) / n;
          cloud.positions.push_back(a + u * (b - a) + v * (c - a));
          truth.push_back(-corners[face].normalized());
        }
    }
    NormalReport report;
    const points::Cloud found = with_normals(cloud, {}, &report);
    const auto normals = normals_of(found);
    ASSERT_EQ(normals.size(), truth.size());
    std::size_t turned = 0;
    for (std::size_t i = 0; i < normals.size(); ++i) turned += normals[i].dot(truth[i]) <= 0 ? 1 : 0;
    EXPECT_EQ(turned, 0u) << n;
    EXPECT_EQ(report.failed, 0u) << n;
  }
}

TEST(Normals, WithstandNoise) {
  const auto at_noise = [](double share) {
    points::Cloud cloud = without_normals(test::sphere(5000));
    const double spacing = std::sqrt(4 * std::numbers::pi / 5000);
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const auto u = random_uniform(7, i, 0);
      cloud.positions[i] += share * spacing * (2 * Vec3(u[0], u[1], u[2]) - Vec3::Ones());
    }
    return errors(with_normals(cloud), [](const Vec3& p) { return p.normalized(); });
  };
  const Errors quarter = at_noise(0.25), whole = at_noise(1);
  EXPECT_LT(quarter.mean, 7);
  EXPECT_EQ(quarter.turned, 0u);
  EXPECT_LT(whole.mean, 25);
  EXPECT_LT(whole.turned, 250u);
}

TEST(Normals, TwoBodiesAreTwoPieces) {
  points::Cloud cloud = without_normals(test::sphere(1000));
  const points::Cloud other = test::sphere(1000, 0.5, Vec3(3, 0, 0));
  cloud.positions.insert(cloud.positions.end(), other.positions.begin(), other.positions.end());
  NormalReport report;
  const auto e = errors(with_normals(cloud, {}, &report),
                        [](const Vec3& p) { return (p.x() < 1.5 ? p : Vec3(p - Vec3(3, 0, 0))).normalized(); });
  EXPECT_EQ(e.turned, 0u);
  EXPECT_EQ(report.pieces, 2u);
}

TEST(Normals, GivenOnesStayAndLeadTheOthers) {
  // A sphere seen from inside: no outermost point would say so.
  points::Cloud cloud = test::sphere(1000);
  auto n = cloud.attributes.values(attribute::kNormal, 3);
  for (double& v : n) v *= -3;
  for (std::size_t i = 0; i < 100; ++i) n[3 * i] = n[3 * i + 1] = n[3 * i + 2] = i % 2 ? 0 : std::nan("");
  NormalReport report;
  const auto out = with_normals(cloud, {}, &report);
  EXPECT_EQ(report.given, 900u);
  EXPECT_EQ(report.zero_normals, 100u);
  EXPECT_EQ(report.estimated, 100u);
  EXPECT_EQ(report.pieces, 0u);
  EXPECT_EQ(errors(out, [](const Vec3& p) { return Vec3(-p.normalized()); }).turned, 0u);
  EXPECT_LT(degrees_between(normals_of(out)[500], -cloud.positions[500]), 1e-5);
}

TEST(Normals, AreEstimatedWhenAllGivenOnesAreZero) {
  points::Cloud cloud = test::sphere(1000);
  for (double& v : cloud.attributes.values(attribute::kNormal, 3)) v = 0;
  NormalReport report;
  const auto e = errors(with_normals(cloud, {}, &report), [](const Vec3& p) { return p.normalized(); });
  EXPECT_EQ(report.zero_normals, 1000u);
  EXPECT_EQ(e.turned, 0u);
}

TEST(Normals, CountThoseThatContradictTheirNeighbours) {
  points::Cloud cloud = test::sphere(1000);
  auto n = cloud.attributes.values(attribute::kNormal, 3);
  for (std::size_t i = 0; i < 3 * 1000; i += 3 * 100)
    for (std::size_t a = 0; a < 3; ++a) n[i + a] *= -1;
  NormalReport report;
  with_normals(cloud, {}, &report);
  EXPECT_EQ(report.failed, 10u);
}

TEST(Normals, LeaveOutWhatIsNoSurface) {
  points::Cloud cloud = without_normals(test::sphere(3000));
  for (std::size_t i = 0; i < 150; ++i) {  // outliers all over the box, farther off than four spacings
    const auto u = random_uniform(3, i, 0);
    const Vec3 p = 4 * Vec3(u[0], u[1], u[2]) - 2 * Vec3::Ones();
    if (std::abs(p.norm() - 1) > 0.25) cloud.positions.push_back(p);
  }
  const std::size_t astray = cloud.size() - 3000;
  for (std::size_t i = 0; i < 20; ++i) cloud.positions.push_back(cloud.positions[i]);
  cloud.positions.push_back(Vec3(std::nan(""), 0, 0));
  cloud.positions.push_back(Vec3(0, std::numeric_limits<double>::infinity(), 0));
  cloud.positions.push_back(Vec3(1e30, 0, 0));
  std::vector<std::int64_t> ids(cloud.size());
  for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<std::int64_t>(i);
  cloud.attributes.set_integers(attribute::kId, 1, ids);

  NormalReport report;
  const auto out = with_normals(cloud, {}, &report);
  EXPECT_EQ(report.not_finite, 2u);
  EXPECT_EQ(report.coincident, 20u);
  EXPECT_GE(report.outliers, astray * 9 / 10);
  EXPECT_LE(report.outliers, astray + 1);
  std::size_t kept = 0;
  for (const std::int64_t id : out.attributes.integers(attribute::kId)) kept += id < 3000;
  EXPECT_EQ(kept, 3000u);
  std::size_t turned = 0;
  for (std::size_t i = 0; i < 3000; ++i) turned += normals_of(out)[i].dot(out.positions[i]) < 0;
  EXPECT_EQ(turned, 0u);
}

TEST(Normals, OfTooFewPointsAreAnErrorOrAPlane) {
  points::Cloud cloud;
  EXPECT_THROW(with_normals(cloud), InvalidInput);
  for (int i = 0; i < 50; ++i) cloud.positions.push_back(Vec3(0.1 * i, 0.2 * i, 0));
  EXPECT_THROW(with_normals(cloud), InvalidInput);  // a line
  cloud.positions.assign(8, Vec3(1, 2, 3));
  EXPECT_THROW(with_normals(cloud), InvalidInput);  // one place
  cloud.positions = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)};
  for (const Vec3& n : normals_of(with_normals(cloud))) EXPECT_NEAR(std::abs(n.z()), 1, 1e-12);
  EXPECT_THROW(with_normals(test::sphere(10), {.neighbours = 2}), InvalidInput);
  EXPECT_THROW(with_normals(test::sphere(10), {.outlier_ratio = std::nan("")}), InvalidInput);
}

TEST(Normals, AreTheSameBitsForAnyNumberOfThreads) {
  const points::Cloud cloud = without_normals(test::torus(3000, 1, 0.4));
  RunOptions one;
  one.threads = 1;
  const auto expected = with_normals(cloud, {}, nullptr, RunControl(one));
  for (const int threads : {2, 3, 5, 8}) {
    one.threads = threads;
    EXPECT_EQ(normals_of(with_normals(cloud, {}, nullptr, RunControl(one))), normals_of(expected));
  }
}

}  // namespace
}  // namespace meniscus::pointset
