#include <meniscus/base/error.h>
#include <meniscus/render/png.h>

#include <gtest/gtest.h>
#include <png.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <map>

namespace meniscus::render {
namespace {

struct Decoded {
  int width = 0;
  int height = 0;
  int channels = 0;
  std::vector<std::uint8_t> bytes;
  std::map<std::string, std::string> texts;
  bool has_time = false;
};

// Reads with libpng's full interface, which also hands out the text chunks.
Decoded decode(const std::vector<std::uint8_t>& file) {
  struct Source {
    const std::vector<std::uint8_t>& file;
    std::size_t at = 0;
  } source{file};
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_read_fn(png, &source, [](png_structp p, png_bytep data, png_size_t size) {
    auto* s = static_cast<Source*>(png_get_io_ptr(p));
    if (s->at + size > s->file.size()) png_error(p, "too short");
    std::memcpy(data, s->file.data() + s->at, size);
    s->at += size;
  });
  png_read_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);
  Decoded d;
  d.width = static_cast<int>(png_get_image_width(png, info));
  d.height = static_cast<int>(png_get_image_height(png, info));
  d.channels = png_get_channels(png, info);
  png_bytepp rows = png_get_rows(png, info);
  for (int y = 0; y < d.height; ++y) d.bytes.insert(d.bytes.end(), rows[y], rows[y] + d.width * d.channels);
  png_textp texts = nullptr;
  int count = 0;
  png_get_text(png, info, &texts, &count);
  for (int i = 0; i < count; ++i) d.texts[texts[i].key] = texts[i].text;
  d.has_time = png_get_valid(png, info, PNG_INFO_tIME) != 0;
  png_destroy_read_struct(&png, &info, nullptr);
  return d;
}

TEST(Png, RoundTripOfPixelsAndTexts) {
  Image image(3, 2);
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 3; ++x) {
      const auto level = [&](int k) { return static_cast<float>(linear_from_srgb((40 * k + 30 * x + 15 * y) / 255.0)); };
      image.at(x, y) = {level(0), level(1), level(2), 1};
    }
  }
  const std::string command = "meniscus render a.ply -o b.png --title '100 % \"done\"'";
  const auto file = encode_png(
      image, std::array{PngText{"Software", "meniscus"}, PngText{"Command", command}, PngText{"Title", "Tröpfchen λ"}});
  const Decoded d = decode(file);
  ASSERT_EQ(d.width, 3);
  ASSERT_EQ(d.height, 2);
  ASSERT_EQ(d.channels, 3);
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 3; ++x) {
      for (int k = 0; k < 3; ++k) {
        EXPECT_EQ(d.bytes[static_cast<std::size_t>((y * 3 + x) * 3 + k)], 40 * k + 30 * x + 15 * y);
      }
    }
  }
  EXPECT_EQ(d.texts.size(), 3U);
  EXPECT_EQ(d.texts.at("Command"), command);
  EXPECT_EQ(d.texts.at("Title"), "Tröpfchen λ");
  EXPECT_FALSE(d.has_time);
  EXPECT_EQ(file, encode_png(image, std::array{PngText{"Software", "meniscus"}, PngText{"Command", command},
                                               PngText{"Title", "Tröpfchen λ"}}));
}

TEST(Png, AlphaIsStraightInTheFile) {
  Image image(2, 1);
  const auto half = static_cast<float>(0.5 * linear_from_srgb(200 / 255.0));
  image.at(0, 0) = {half, half, 0, 0.5F};
  const Decoded d = decode(encode_png(image));
  ASSERT_EQ(d.channels, 4);
  EXPECT_EQ(d.bytes, (std::vector<std::uint8_t>{200, 200, 0, 128, 0, 0, 0, 0}));
}

TEST(Png, NonFiniteAndOutOfRangeValuesStayInTheFile) {
  Image image(3, 1);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  image.at(0, 0) = {nan, std::numeric_limits<float>::infinity(), -5, 1};
  image.at(1, 0) = {7, 1, 0.0F, 1};
  image.at(2, 0) = {1, 1, 1, nan};
  const Decoded d = decode(encode_png(image));
  ASSERT_EQ(d.channels, 4);
  EXPECT_EQ(d.bytes, (std::vector<std::uint8_t>{0, 0, 0, 255, 255, 255, 0, 255, 0, 0, 0, 0}));
}

TEST(Png, RefusesEmptyImagesAndBadKeywords) {
  EXPECT_THROW((void)encode_png(Image()), InvalidInput);
  const Image image(1, 1);
  for (const std::string& bad : {std::string(), std::string(80, 'a'), std::string("naïve"), std::string("a\nb"),
                                 std::string(" leading"), std::string("double  space")}) {
    EXPECT_THROW((void)encode_png(image, std::array{PngText{bad, "x"}}), InvalidInput) << bad;
  }
}

}  // namespace
}  // namespace meniscus::render
