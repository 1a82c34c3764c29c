#pragma once

#include <meniscus/render/color_map.h>
#include <meniscus/render/image.h>

#include <string>

namespace meniscus::render {

/// A number with three significant digits, as a legend shows it: 0.25, 1.2e+06.
std::string short_number(double value);

/// Draws a colour bar with its title and the values at both ends along the right side of the image; pictures lower than
/// 100 pixels stay as they are.
void draw_legend(Image& image, ColorMap map, const std::string& title, double min, double max);

}  // namespace meniscus::render
