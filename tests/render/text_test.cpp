#include <meniscus/render/legend.h>
#include <meniscus/render/text.h>

#include <gtest/gtest.h>

#include <set>
#include <vector>

namespace meniscus::render {
namespace {

std::vector<bool> inked(char c) {
  Image image(48, 72);
  draw_text(image, 4, 4, std::string(1, c), 49, Vec3::Ones());
  std::vector<bool> dots;
  for (const Pixel& p : image.pixels()) dots.push_back(p.a > 0.5F);
  return dots;
}

TEST(Text, EveryPrintableCharacterLooksDifferent) {
  std::set<std::vector<bool>> seen;
  for (char c = ' '; c <= '~'; ++c) EXPECT_TRUE(seen.insert(inked(c)).second) << c;
  EXPECT_TRUE(seen.insert(inked('\x7f')).second);
}

TEST(Text, StaysInItsBox) {
  Image image(200, 40);
  draw_text(image, 10, 10, "HI8", 14, Vec3::Ones());
  const double right = 10 + text_width("HI8", 14);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 200; ++x) {
      const bool inside = x >= 9 && x <= right + 1 && y >= 9 && y <= 25;
      EXPECT_TRUE(inside || image.at(x, y).a == 0) << x << ' ' << y;
    }
  }
}

TEST(Legend, NumbersAreShort) {
  EXPECT_EQ(short_number(0.25), "0.25");
  EXPECT_EQ(short_number(-1234567), "-1.23e+06");
  EXPECT_EQ(short_number(0), "0");
}

TEST(Legend, ShowsBothEndsOfTheMap) {
  Image image(400, 300);
  draw_legend(image, ColorMap::Sequential, "speed", 0, 1);
  const auto count = [&](const Vec3& color) {
    int n = 0;
    for (const Pixel& p : image.pixels()) n += (Vec3(p.r, p.g, p.b) - color).cwiseAbs().maxCoeff() < 0.02 ? 1 : 0;
    return n;
  };
  EXPECT_GT(count(color_of(ColorMap::Sequential, 0)), 3);
  EXPECT_GT(count(color_of(ColorMap::Sequential, 1)), 3);
}

}  // namespace
}  // namespace meniscus::render
