#include <meniscus/base/error.h>
#include <meniscus/render/image.h>

#include <gtest/gtest.h>

namespace meniscus::render {
namespace {

TEST(Image, SrgbCurveAndItsInverse) {
  for (int i = 0; i <= 255; ++i) EXPECT_NEAR(srgb_from_linear(linear_from_srgb(i / 255.0)), i / 255.0, 1e-12);
  EXPECT_NEAR(linear_from_srgb(0.5), 0.21404114, 1e-7);
  EXPECT_EQ(srgb_from_linear(-1), 0);
  EXPECT_NEAR(srgb_from_linear(2), 1, 1e-12);
}

TEST(Image, ToneMapKeepsDarkTonesAndOrderAndStaysBelowOne) {
  Image image(100, 1);
  for (int x = 0; x < 100; ++x) {
    const auto v = static_cast<float>(0.05 * x);
    image.at(x, 0) = {v, v, v, 1};
  }
  image.at(99, 0) = {0.3F, 0.3F, 0.3F, 0.5F};  // straight 0.6
  tone_map(image);
  EXPECT_FLOAT_EQ(image.at(10, 0).r, 0.5F);
  EXPECT_FLOAT_EQ(image.at(99, 0).r, 0.3F);
  for (int x = 1; x < 99; ++x) {
    EXPECT_GE(image.at(x, 0).r, image.at(x - 1, 0).r);
    EXPECT_LE(image.at(x, 0).r, 1);
  }
}

TEST(Image, ContactSheetPlacesEveryImage) {
  std::vector<Image> images;
  for (int i = 0; i < 3; ++i) {
    images.emplace_back(4, 3);
    fill_rectangle(images.back(), 0, 0, 4, 3, Vec3(0.1 * (i + 1), 0, 0));
  }
  const Image sheet = contact_sheet(images, 2, 1);
  EXPECT_EQ(sheet.width(), 2 * 5 + 1);
  EXPECT_EQ(sheet.height(), 2 * 4 + 1);
  EXPECT_FLOAT_EQ(sheet.at(0, 0).r, 1);
  EXPECT_FLOAT_EQ(sheet.at(1, 1).r, 0.1F);
  EXPECT_FLOAT_EQ(sheet.at(6, 1).r, 0.2F);
  EXPECT_FLOAT_EQ(sheet.at(1, 5).r, 0.3F);
  EXPECT_FLOAT_EQ(sheet.at(7, 6).r, 1);  // the fourth cell is empty
  EXPECT_TRUE(contact_sheet({}, 2).empty());
  EXPECT_THROW((void)contact_sheet(images, 0), InvalidInput);
}

TEST(Image, SizesAreChecked) {
  EXPECT_THROW(Image(-1, 5), InvalidInput);
  EXPECT_THROW(Image(1 << 20, 1 << 20), ResourceLimit);
}

}  // namespace
}  // namespace meniscus::render
