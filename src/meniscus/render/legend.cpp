#include <meniscus/render/legend.h>
#include <meniscus/render/text.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace meniscus::render {

std::string short_number(double value) {
  std::array<char, 64> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, std::chars_format::general, 3).ptr;
  return {buffer.data(), end};
}

void draw_legend(Image& image, ColorMap map, const std::string& title, double min, double max) {
  if (image.height() < 100) return;
  const Vec3 ink = Vec3::Constant(0.03);
  const double letter = std::max(7.0, image.height() / 55.0);
  const int bar_width = std::max(6, image.height() / 48);
  const int bar_height = image.height() * 2 / 5;
  const std::string high = short_number(max);
  const std::string low = short_number(min);

  // The widest line ends at the margin; everything else shares its left edge.
  const double numbers = bar_width + letter + std::max(text_width(high, letter), text_width(low, letter));
  const double width = std::max(numbers, text_width(title, letter));
  const int left = static_cast<int>(image.width() - letter * 1.8 - width);
  const int top = (image.height() - bar_height) / 2;

  fill_rectangle(image, left - 1, top - 1, bar_width + 2, bar_height + 2, ink, 0.8);
  for (int y = 0; y < bar_height; ++y) {
    fill_rectangle(image, left, top + y, bar_width, 1, color_of(map, 1 - static_cast<double>(y) / (bar_height - 1)));
  }
  draw_text(image, left, top - 2.2 * letter, title, letter, ink);
  const double text_left = left + bar_width + letter;
  draw_text(image, text_left, top, high, letter, ink);
  draw_text(image, text_left, top + bar_height - letter, low, letter, ink);
}

}  // namespace meniscus::render
