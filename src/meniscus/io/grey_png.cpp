#include <meniscus/io/grey_png.h>

#include <meniscus/base/error.h>
#include <meniscus/io/file_bytes.h>

#include <png.h>

#include <cstdint>

namespace meniscus::io {
namespace {

constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 30;
constexpr std::uint64_t kMostPixels = std::uint64_t{1} << 26;

/// libpng's reader, let go whatever happens.
struct Reader {
  png_image image{};
  Reader() { image.version = PNG_IMAGE_VERSION; }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  ~Reader() { png_image_free(&image); }
};

}  // namespace

pointset::GreyImage read_grey_png(const std::string& path) {
  const std::string bytes = load_plain_file(path, kMostBytes);
  Reader reader;
  png_image& image = reader.image;
  const auto fail = [&] { throw IoError(path, std::string("this is no PNG image: ") + image.message); };
  if (png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()) == 0) fail();
  const std::uint64_t pixels = std::uint64_t{image.width} * image.height;
  if (pixels > kMostPixels)
    throw ResourceLimit(path + ": an image of " + std::to_string(image.width) + " by " + std::to_string(image.height) +
                        " pixels is too large");
  image.format = PNG_FORMAT_GA;
  std::vector<png_byte> data(2 * pixels);
  if (png_image_finish_read(&image, nullptr, data.data(), 0, nullptr) == 0) fail();
  pointset::GreyImage grey{image.width, image.height, std::vector<float>(pixels)};
  for (std::size_t i = 0; i < pixels; ++i)
    grey.values[i] = static_cast<float>(data[2 * i]) / 255.0F * static_cast<float>(data[2 * i + 1]) / 255.0F;
  return grey;
}

}  // namespace meniscus::io
