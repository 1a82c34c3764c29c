#pragma once

#include <meniscus/render/image.h>

#include <string_view>

namespace meniscus::render {

/// Width in pixels of one line of text whose capital letters are `height` pixels tall.
double text_width(std::string_view text, double height);

/// Draws one line of text, anti-aliased; (x, y) is its top left corner, `height` that of a capital letter, pixels.
/// Knows printable ASCII; anything else shows as a box.
void draw_text(Image& image, double x, double y, std::string_view text, double height, const Vec3& color);

}  // namespace meniscus::render
