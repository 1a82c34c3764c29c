#pragma once

#include <meniscus/render/image.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace meniscus::render {

/// A text chunk of a PNG file. Keywords have 1 to 79 printable ASCII characters and no outer or double spaces;
/// the text is UTF-8.
struct PngText {
  std::string keyword;  ///< "Software", "Command", "Title", ...
  std::string text;
};

/// The bytes of an 8-bit sRGB PNG file: RGB if every pixel is opaque, RGBA with straight alpha otherwise. Holds the texts
/// given and nothing else: no time, no host. Non-finite values become 0. The same image gives the same bytes.
/// Throws InvalidInput for an image without pixels or a bad keyword, ResourceLimit when libpng runs out of memory.
std::vector<std::uint8_t> encode_png(const Image& image, std::span<const PngText> texts = {});

}  // namespace meniscus::render
