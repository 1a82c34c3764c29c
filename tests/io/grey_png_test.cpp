#include <meniscus/io/grey_png.h>

#include <meniscus/base/error.h>
#include <meniscus/render/png.h>

#include "support/scratch.h"

#include <gtest/gtest.h>

#include <fstream>

namespace meniscus::io {
namespace {

using test::Scratch;

void write(const std::string& path, std::span<const std::uint8_t> bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

std::vector<std::uint8_t> small_image() {
  render::Image image(3, 2);
  for (int x = 0; x < 3; ++x)
    for (int y = 0; y < 2; ++y) image.at(x, y) = {0, 0, 0, 1};
  image.at(1, 0) = {1, 1, 1, 1};
  const float half = static_cast<float>(render::linear_from_srgb(0.5));
  image.at(2, 1) = {half, half, half, 1};
  return render::encode_png(image);
}

TEST(GreyPng, HoldsBrightnessAsEncodedFromTheTop) {
  const Scratch s;
  write(s / "a.png", small_image());
  const auto image = read_grey_png(s / "a.png");
  ASSERT_EQ(image.width, 3u);
  ASSERT_EQ(image.height, 2u);
  EXPECT_EQ(image.at(0, 0), 0);
  EXPECT_EQ(image.at(1, 0), 1);
  EXPECT_NEAR(image.at(2, 1), 0.5, 0.003);
}

TEST(GreyPng, TransparentPixelsAreDark) {
  const Scratch s;
  render::Image image(2, 1);
  image.at(0, 0) = {0.5F, 0.5F, 0.5F, 0.5F};  // white, half covered
  write(s / "a.png", render::encode_png(image));
  const auto grey = read_grey_png(s / "a.png");
  EXPECT_NEAR(grey.at(0, 0), 0.5, 0.003);
  EXPECT_EQ(grey.at(1, 0), 0);
}

TEST(GreyPng, BadFilesAreErrorsThatNameThem) {
  const Scratch s;
  EXPECT_THROW(read_grey_png(s / "missing.png"), IoError);
  const auto good = small_image();
  for (std::size_t size = 0; size < good.size() - 12; ++size) {  // what is left out at the very end is the closing mark
    write(s / "cut.png", std::span(good).first(size));
    EXPECT_THROW(read_grey_png(s / "cut.png"), Error) << size;
  }
}

TEST(GreyPng, AHeaderAloneMakesNoRoom) {
  const Scratch s;
  auto bytes = small_image();
  bytes[16] = bytes[20] = 0x7f;  // two thousand million pixels wide and high; the check sum is then wrong as well
  write(s / "huge.png", bytes);
  EXPECT_THROW(read_grey_png(s / "huge.png"), Error);
}

}  // namespace
}  // namespace meniscus::io
