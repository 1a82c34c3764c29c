#include <meniscus/field/blobs.kernel.h>
#include <meniscus/field/cpu.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

namespace meniscus::field {
namespace {

double exponential(double x) {
  alignas(16) double out[2];
  packet::exponential(packet::Sse2(x)).store_aligned(out);
  return out[0];
}

TEST(Exponential, IsWithinOneUlpOfTheLibrary) {
  std::mt19937_64 random(7);
  double worst = 0;
  const auto look = [&](double x) {
    const double expected = std::exp(x);  // itself within 0.51 ulp
    const double ulp = std::nextafter(expected, std::numeric_limits<double>::infinity()) - expected;
    worst = std::max(worst, std::abs(exponential(x) - expected) / ulp);
  };
  for (int i = 0; i < 200'000; ++i) look(-36.8 * std::generate_canonical<double, 53>(random));
  for (int i = 0; i < 200'000; ++i) look(1400 * std::generate_canonical<double, 53>(random) - 700);
  // Where the reduction changes over, and near zero.
  for (int n = -60; n <= 60; ++n)
    for (const double off : {-1e-12, 0.0, 1e-12}) look((n + 0.5) * std::log(2.0) + off);
  for (double x = 1; x > 1e-300; x *= 0.01) look(-x), look(x);
  EXPECT_LE(worst, 1.0);
  EXPECT_EQ(exponential(0), 1.0);
  EXPECT_EQ(exponential(-0.0), 1.0);
}

/// Sums over many blobs by every instruction set that this processor has.
TEST(Exponential, SumsOfBlobsHaveTheSameBitsForEveryInstructionSet) {
  constexpr std::uint32_t kBlobs = 50;
  constexpr std::size_t kPoints = 37;
  std::mt19937_64 random(11);
  const auto uniform = [&] { return 2 * std::generate_canonical<double, 53>(random) - 1; };
  std::vector<double> q[5], rate[5];
  BlobArrays blobs{};
  for (std::size_t s = 0; s < 5; ++s) {
    for (std::uint32_t i = 0; i < kBlobs; ++i) q[s].push_back(s == 3 ? 4 + 3 * uniform() : uniform());
    for (std::uint32_t i = 0; i < kBlobs; ++i) rate[s].push_back(uniform());
    blobs.q[s] = q[s].data();
    blobs.rate[s] = rate[s].data();
  }
  blobs.moving = true;
  PositionBatch x(kPoints);
  for (std::size_t p = 0; p < kPoints; ++p) x.set(p, {uniform(), uniform(), uniform()});
  const BlobRange all{0, kBlobs};
  const double bias[2] = {0.35, 0.1};
  const BlobKernels sse2 = kernel::table<packet::Sse2>();
  for (const std::size_t kind : {std::size_t{0}, std::size_t{1}})
    for (const Order order : {Order::Value, Order::GradientTime, Order::HessianTime}) {
      const auto summed = [&](const BlobKernels& kernels) {
        JetBatch out(kPoints, order);
        kernels.sum[0][kind](blobs, &all, 1, bias, x.view(), out.view());
        std::vector<double> rows;
        for (std::size_t r = 0; r < row_count(order); ++r)
          rows.insert(rows.end(), out.view().row(r), out.view().row(r) + kPoints);
        return rows;
      };
      const std::vector<double> expected = summed(sse2);
      const auto same = [&](const std::vector<double>& rows) {
        return std::memcmp(rows.data(), expected.data(), expected.size() * sizeof(double)) == 0;
      };
      if (has_avx2()) EXPECT_TRUE(same(summed(kBlobsAvx2)));
      if (has_avx512()) EXPECT_TRUE(same(summed(kBlobsAvx512)));
    }
}

}  // namespace
}  // namespace meniscus::field
