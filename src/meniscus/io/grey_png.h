#pragma once

#include <meniscus/pointset/image_map.h>

#include <string>

namespace meniscus::io {

/// The brightness of a PNG file of any kind, from 0 to 1, as encoded (sRGB grey of the colours, times opacity).
/// Throws IoError for a file that is missing or is no PNG, ResourceLimit beyond 2^26 pixels.
pointset::GreyImage read_grey_png(const std::string& path);

}  // namespace meniscus::io
