#include <meniscus/base/error.h>
#include <meniscus/render/image.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace meniscus::render {
namespace {

constexpr double kMaxPixels = 268'435'456.0;  // 2^28: 4 GB of pixels
constexpr double kShoulder = 0.7;

double shoulder(double x) {
  if (!(x > kShoulder)) return x;
  return kShoulder + (1 - kShoulder) * (1 - std::exp((kShoulder - x) / (1 - kShoulder)));
}

}  // namespace

Image::Image(int width, int height) : width_(width), height_(height) {
  if (width < 0 || height < 0) throw InvalidInput("an image cannot have a negative size");
  if (static_cast<double>(width) * height > kMaxPixels) {
    throw ResourceLimit("an image of " + std::to_string(width) + "x" + std::to_string(height) + " pixels is too large");
  }
  pixels_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
}

double srgb_from_linear(double linear) {
  const double x = std::clamp(linear, 0.0, 1.0);
  return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
}

double linear_from_srgb(double encoded) {
  const double x = std::clamp(encoded, 0.0, 1.0);
  return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
}

Vec3 color_from_hex(unsigned rgb) {
  const auto channel = [&](unsigned shift) { return linear_from_srgb(((rgb >> shift) & 0xffU) / 255.0); };
  return {channel(16), channel(8), channel(0)};
}

void tone_map(Image& image, double exposure) {
  for (Pixel& p : image.pixels()) {
    // The curve belongs to the straight colour: a half-covered pixel is rolled off like its covered half.
    const double scale = p.a > 0 ? exposure / static_cast<double>(p.a) : 0;
    for (float* c : {&p.r, &p.g, &p.b}) *c = static_cast<float>(shoulder(*c * scale) * static_cast<double>(p.a));
  }
}

void blend(Image& image, int x, int y, const Vec3& color, double opacity) {
  if (x < 0 || y < 0 || x >= image.width() || y >= image.height()) return;
  Pixel& p = image.at(x, y);
  const auto over = [&](float below, double above) { return static_cast<float>(above * opacity + below * (1 - opacity)); };
  p = {over(p.r, color.x()), over(p.g, color.y()), over(p.b, color.z()), over(p.a, 1)};
}

void fill_rectangle(Image& image, int x, int y, int width, int height, const Vec3& color, double opacity) {
  for (int j = std::max(y, 0); j < std::min(y + height, image.height()); ++j) {
    for (int i = std::max(x, 0); i < std::min(x + width, image.width()); ++i) blend(image, i, j, color, opacity);
  }
}

Image contact_sheet(std::span<const Image> images, int columns, int gap, const Vec3& background) {
  if (columns < 1) throw InvalidInput("a contact sheet needs at least one column");
  if (gap < 0) throw InvalidInput("the gap of a contact sheet cannot be negative");
  if (images.empty()) return {};

  int cell_width = 0;
  int cell_height = 0;
  for (const Image& image : images) {
    cell_width = std::max(cell_width, image.width());
    cell_height = std::max(cell_height, image.height());
  }
  const int count = static_cast<int>(images.size());
  columns = std::min(columns, count);
  const int rows = (count + columns - 1) / columns;
  Image sheet(columns * (cell_width + gap) + gap, rows * (cell_height + gap) + gap);
  fill_rectangle(sheet, 0, 0, sheet.width(), sheet.height(), background);

  for (int i = 0; i < count; ++i) {
    const Image& image = images[static_cast<std::size_t>(i)];
    const int left = gap + (i % columns) * (cell_width + gap) + (cell_width - image.width()) / 2;
    const int top = gap + (i / columns) * (cell_height + gap) + (cell_height - image.height()) / 2;
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        const Pixel& p = image.at(x, y);
        if (!(p.a > 0)) continue;
        blend(sheet, left + x, top + y, Vec3(p.r, p.g, p.b) / p.a, p.a);
      }
    }
  }
  return sheet;
}

}  // namespace meniscus::render
