#pragma once

#include <meniscus/base/vec.h>

#include <span>
#include <vector>

namespace meniscus::render {

/// One pixel: linear light (Rec. 709 primaries), colour already multiplied by alpha.
struct Pixel {
  float r = 0;
  float g = 0;
  float b = 0;
  float a = 0;
};

/// A picture of linear floats; row 0 is the top. A new image is transparent black.
class Image {
 public:
  Image() = default;
  /// Throws InvalidInput for a negative size, ResourceLimit beyond 2^28 pixels.
  Image(int width, int height);

  int width() const { return width_; }
  int height() const { return height_; }
  bool empty() const { return pixels_.empty(); }

  Pixel& at(int x, int y) { return pixels_[index(x, y)]; }
  const Pixel& at(int x, int y) const { return pixels_[index(x, y)]; }
  std::span<Pixel> pixels() { return pixels_; }
  std::span<const Pixel> pixels() const { return pixels_; }

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }
  int width_ = 0;
  int height_ = 0;
  std::vector<Pixel> pixels_;
};

/// Linear light to the sRGB transfer curve and back; both map [0, 1] to [0, 1].
double srgb_from_linear(double linear);
double linear_from_srgb(double encoded);
/// The linear colour of a web colour such as 0x3366cc.
Vec3 color_from_hex(unsigned rgb);

/// Multiplies by `exposure`, then rolls values above 0.7 off towards 1, so that highlights keep their hue and nothing clips.
/// Below 0.7 the picture stays linear.
void tone_map(Image& image, double exposure = 1);

/// Puts `color` (linear, straight) over the pixel with that opacity; outside the image nothing happens.
void blend(Image& image, int x, int y, const Vec3& color, double opacity);

/// Fills a rectangle of pixels.
void fill_rectangle(Image& image, int x, int y, int width, int height, const Vec3& color, double opacity = 1);

/// Tiles the images, row by row, into a sheet with `columns` columns and `gap` pixels of `background` around each.
/// Cells are as large as the largest image; smaller ones are centred. Throws InvalidInput for fewer than one column or a
/// negative gap. No images: an empty image.
Image contact_sheet(std::span<const Image> images, int columns, int gap = 8, const Vec3& background = Vec3::Ones());

}  // namespace meniscus::render
