#include <meniscus/render/sampler.h>

#include <gtest/gtest.h>

#include <vector>

namespace meniscus::render {
namespace {

TEST(Sampler, EveryUseOfAPixelIsStratified) {
  for (const Use use : {Use::Pixel, Use::Time, Use::MirrorDome}) {
    const PixelSampler pixel(3, 17, 101, 64);
    for (const int columns : {1, 2, 8, 32, 64}) {
      std::vector<int> hits(64, 0);
      for (std::uint32_t i = 0; i < 64; ++i) {
        const Vec2 u = pixel.pair(use, i);
        ASSERT_TRUE(u.x() >= 0 && u.x() < 1 && u.y() >= 0 && u.y() < 1);
        const int column = static_cast<int>(u.x() * columns);
        const int row = static_cast<int>(u.y() * (64 / columns));
        ++hits[static_cast<std::size_t>(row * columns + column)];
      }
      for (const int h : hits) EXPECT_EQ(h, 1) << columns;  // one point in each of 64 equal boxes of any shape
    }
  }
}

TEST(Sampler, AlignedSquaresOfPixelsAreStratifiedTogether) {
  std::vector<int> hits(64, 0);
  for (std::uint32_t y = 4; y < 8; ++y) {
    for (std::uint32_t x = 8; x < 12; ++x) {
      for (std::uint32_t i = 0; i < 4; ++i) {
        const Vec2 u = PixelSampler(0, x, y, 4).pair(Use::Dome, i);
        ++hits[static_cast<std::size_t>(static_cast<int>(u.x() * 8) * 8 + static_cast<int>(u.y() * 8))];
      }
    }
  }
  for (const int h : hits) EXPECT_EQ(h, 1);
}

// Two uses together fill the square: with one order for both they would lie on a few lines.
TEST(Sampler, DifferentUsesAreIndependent) {
  const int n = 16;
  std::vector<int> hits(static_cast<std::size_t>(n * n), 0);
  const PixelSampler pixel(0, 5, 9, 4096);
  for (std::uint32_t i = 0; i < 4096; ++i) {
    const int a = static_cast<int>(pixel.pair(Use::Pixel, i).x() * n);
    const int b = static_cast<int>(pixel.pair(Use::Time, i).x() * n);
    ++hits[static_cast<std::size_t>(a * n + b)];
  }
  for (const int h : hits) EXPECT_NEAR(h, 16, 16);
  int empty = 0;
  for (const int h : hits) empty += h == 0 ? 1 : 0;
  EXPECT_EQ(empty, 0);
}

TEST(Sampler, OneSampleAndTheSeed) {
  const Vec2 a = PixelSampler(0, 0, 0, 1).pair(Use::Key, 0);
  const Vec2 b = PixelSampler(1, 0, 0, 1).pair(Use::Key, 0);
  EXPECT_NE(a, b);
  EXPECT_EQ(a, PixelSampler(0, 0, 0, 1).pair(Use::Key, 0));
}

}  // namespace
}  // namespace meniscus::render
