#include <meniscus/base/random.h>
#include <meniscus/field/blobs.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

namespace meniscus::field {
namespace {

constexpr std::size_t kBlobs = 2000;
constexpr double kRadius = 0.1;

Vec3 place(std::uint64_t key, std::uint64_t id) {
  const auto u = random_uniform(key, id, 0);
  return 2 * Vec3(u[0], u[1], u[2]) - Vec3::Ones();
}

std::unique_ptr<Field> crowd(BlobKernel kernel) {
  std::vector<Blob> items;
  for (std::size_t i = 0; i < kBlobs; ++i) {
    const Vec3 c = place(1, i);
    items.push_back({{c.x(), c.y(), c.z()}, kRadius, 0.5 + 0.001 * static_cast<double>(i)});
  }
  return blobs(kernel, 0.35, items);
}

/// Points that lie together, points here and there, points that nothing reaches, and what is no point at all.
PositionBatch points_of_all_kinds() {
  PositionBatch x(700);
  for (std::size_t i = 0; i < 700; ++i) x.set(i, i < 300 ? Vec3(0.2 * place(2, i)) : Vec3(1.5 * place(3, i)));
  x.set(0, {std::nan(""), 0, 0});
  x.set(260, {0, std::nan(""), 0});
  x.set(40, {std::numeric_limits<double>::infinity(), 0, 0});
  for (std::size_t i = 600; i < 610; ++i) x.set(i, {50, static_cast<double>(i), 0});
  return x;
}

TEST(Blobs, AreSumsOverAllBlobs) {
  const PositionBatch x = points_of_all_kinds();
  const auto field = crowd(BlobKernel::Gaussian);
  JetBatch jets(700, Order::Hessian);
  field->evaluate(x.view(), jets.view());
  for (std::size_t p = 0; p < 700; ++p) {
    const Vec3 at = x.view()[p];
    if (!at.allFinite()) {
      EXPECT_TRUE(std::isnan(jets.value(p)));
      continue;
    }
    double f = 0.35;
    Vec3 g = Vec3::Zero();
    Mat3 h = Mat3::Zero();
    const double s = 2 / (kRadius * kRadius);
    for (std::size_t i = 0; i < kBlobs; ++i) {
      const Vec3 d = at - place(1, i);
      const double e = (0.5 + 0.001 * static_cast<double>(i)) * std::exp(-0.5 * s * d.squaredNorm());
      f -= e;
      g += s * e * d;
      h -= e * (s * s * d * d.transpose() - s * Mat3::Identity());
    }
    EXPECT_NEAR(jets.value(p), f, 1e-12);
    EXPECT_LT((jets.gradient(p) - g).norm(), 1e-11 * s);
    EXPECT_LT((jets.hessian(p) - h).norm(), 1e-11 * s * s);
  }
}

TEST(Blobs, TheBitsOfAPointDoNotDependOnItsCompany) {
  const PositionBatch x = points_of_all_kinds();
  for (const BlobKernel kernel : {BlobKernel::Gaussian, BlobKernel::Compact})
    for (const Order order : {Order::Value, Order::Gradient, Order::HessianTime}) {
      const auto field = crowd(kernel);
      JetBatch together(700, order), alone(1, order);
      field->evaluate(x.view(), together.view());
      for (std::size_t p = 0; p < 700; ++p) {
        field->evaluate(x.view().part(p, 1), alone.view());
        for (std::size_t r = 0; r < row_count(order); ++r)
          EXPECT_EQ(std::memcmp(&together.view().row(r)[p], &alone.view().row(r)[0], sizeof(double)), 0)
              << p << " row " << r;
      }
    }
}

}  // namespace
}  // namespace meniscus::field
