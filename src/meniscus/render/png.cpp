#include <meniscus/base/error.h>
#include <meniscus/render/png.h>

#include <png.h>

#include <algorithm>
#include <cmath>
#include <csetjmp>

namespace meniscus::render {
namespace {

// libpng would drop a chunk with another keyword in silence.
void check_keyword(const std::string& keyword) {
  const auto printable = [](char c) { return c >= 32 && c < 127; };
  const bool good = !keyword.empty() && keyword.size() <= 79 && std::all_of(keyword.begin(), keyword.end(), printable) &&
                    keyword.front() != ' ' && keyword.back() != ' ' && keyword.find("  ") == std::string::npos;
  if (!good)
    throw InvalidInput("a PNG keyword has 1 to 79 printable ASCII characters and single inner spaces: \"" + keyword + "\"");
}

std::uint8_t quantize(double linear) {
  if (!std::isfinite(linear)) return 0;
  return static_cast<std::uint8_t>(std::lround(255 * srgb_from_linear(linear)));
}

std::vector<std::uint8_t> bytes_of(const Image& image, bool opaque) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(image.pixels().size() * (opaque ? 3 : 4));
  for (const Pixel& p : image.pixels()) {
    const double alpha = static_cast<double>(p.a);
    const double scale = alpha > 0 ? 1 / alpha : 0;
    for (const float c : {p.r, p.g, p.b}) bytes.push_back(quantize(static_cast<double>(c) * scale));
    if (!opaque) bytes.push_back(static_cast<std::uint8_t>(std::lround(255 * std::clamp(alpha, 0.0, 1.0))));
  }
  return bytes;
}

// What the C callbacks need; outlives the jump.
struct Writer {
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::vector<std::uint8_t> out;
  std::vector<png_text> texts;
  std::vector<png_bytep> rows;
  bool out_of_memory = false;
  ~Writer() { png_destroy_write_struct(&png, &info); }
};

void append(png_structp png, png_bytep data, png_size_t size) {
  auto* writer = static_cast<Writer*>(png_get_io_ptr(png));
  try {
    writer->out.insert(writer->out.end(), data, data + size);
    return;
  } catch (const std::exception&) {
    writer->out_of_memory = true;
  }
  png_error(png, "out of memory");  // outside the handler: it jumps
}

void stay_silent(png_structp, png_const_charp) {}

void stop(png_structp png, png_const_charp) { png_longjmp(png, 1); }

// Holds the setjmp: no object with a destructor may live in this frame.
bool write(Writer& writer, png_uint_32 width, png_uint_32 height, bool opaque) {
  if (setjmp(png_jmpbuf(writer.png)) != 0) return false;
  png_set_write_fn(writer.png, &writer, append, nullptr);
  png_set_IHDR(writer.png, writer.info, width, height, 8, opaque ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_RGB_ALPHA,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB(writer.png, writer.info, PNG_sRGB_INTENT_PERCEPTUAL);
  png_set_text(writer.png, writer.info, writer.texts.data(), static_cast<int>(writer.texts.size()));
  png_set_rows(writer.png, writer.info, writer.rows.data());
  png_write_png(writer.png, writer.info, PNG_TRANSFORM_IDENTITY, nullptr);
  return true;
}

}  // namespace

std::vector<std::uint8_t> encode_png(const Image& image, std::span<const PngText> texts) {
  if (image.empty()) throw InvalidInput("cannot encode an image without pixels");
  for (const PngText& text : texts) check_keyword(text.keyword);
  const auto pixels = image.pixels();
  const bool opaque = std::all_of(pixels.begin(), pixels.end(), [](const Pixel& p) { return p.a >= 1; });
  std::vector<std::uint8_t> bytes = bytes_of(image, opaque);
  std::vector<PngText> copies(texts.begin(), texts.end());

  Writer writer;
  for (PngText& copy : copies) {
    // ASCII goes into tEXt, which everything reads; the rest needs iTXt.
    const bool ascii = std::all_of(copy.text.begin(), copy.text.end(), [](char c) { return c >= 0; });
    png_text chunk{};
    chunk.compression = ascii ? PNG_TEXT_COMPRESSION_NONE : PNG_ITXT_COMPRESSION_NONE;
    chunk.key = copy.keyword.data();
    chunk.text = copy.text.data();
    (ascii ? chunk.text_length : chunk.itxt_length) = copy.text.size();
    writer.texts.push_back(chunk);
  }
  const std::size_t stride = static_cast<std::size_t>(image.width()) * (opaque ? 3 : 4);
  for (int y = 0; y < image.height(); ++y) writer.rows.push_back(bytes.data() + static_cast<std::size_t>(y) * stride);

  writer.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, stop, stay_silent);
  if (writer.png != nullptr) writer.info = png_create_info_struct(writer.png);
  if (writer.info == nullptr) throw ResourceLimit("libpng: out of memory");
  if (!write(writer, static_cast<png_uint_32>(image.width()), static_cast<png_uint_32>(image.height()), opaque)) {
    if (writer.out_of_memory) throw ResourceLimit("not enough memory to encode the PNG");
    throw InvalidInput("libpng refuses an image of " + std::to_string(image.width()) + "x" + std::to_string(image.height()) +
                       " pixels or one of its texts");
  }
  return std::move(writer.out);
}

}  // namespace meniscus::render
