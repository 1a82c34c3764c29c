#include <meniscus/base/error.h>
#include <meniscus/io/base64.h>
#include <meniscus/io/text_scanner.h>
#include <meniscus/io/vtk_xml_array.h>

#include <zlib.h>

#include <algorithm>
#include <array>

namespace meniscus::io {
namespace {

constexpr std::array<std::pair<std::string_view, NumberType>, 10> kTypes = {{{"Int8", NumberType::Int8},
                                                                             {"UInt8", NumberType::UInt8},
                                                                             {"Int16", NumberType::Int16},
                                                                             {"UInt16", NumberType::UInt16},
                                                                             {"Int32", NumberType::Int32},
                                                                             {"UInt32", NumberType::UInt32},
                                                                             {"Int64", NumberType::Int64},
                                                                             {"UInt64", NumberType::UInt64},
                                                                             {"Float32", NumberType::Float32},
                                                                             {"Float64", NumberType::Float64}}};

class ArrayDecoder {
 public:
  ArrayDecoder(const VtkXmlArray& array, const VtkXmlEncoding& encoding) : array_(array), encoding_(encoding) {}

  NumberArray decode_text() const {
    TextScanner in(array_.content, encoding_.path + ", array '" + array_.name + "'");
    NumberArray out;
    out.type = array_.type;
    while (in.skip_space()) {
      if (is_integer(array_.type))
        out.integers.push_back(in.integer());
      else
        out.reals.push_back(in.number());
    }
    return out;
  }

  NumberArray decode_bytes(std::string_view data, bool base64) {
    base64_ = base64;
    data_ = data;
    const std::string bytes = encoding_.compressed ? read_compressed() : read_plain();
    if (bytes.size() % size_of(array_.type) != 0) fail("its length is no multiple of its numbers' size");
    return decode(bytes, array_.type, encoding_.order);
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const {
    throw IoError(encoding_.path, "array '" + array_.name + "': " + reason);
  }

  std::uint64_t header_number(std::string_view bytes, std::size_t i) const {
    if (encoding_.header == NumberType::UInt32) return load<std::uint32_t>(bytes.data() + 4 * i, encoding_.order);
    return load<std::uint64_t>(bytes.data() + 8 * i, encoding_.order);
  }

  /// The next `count` bytes of the data. In base64 every run of bytes is padded on its own, so runs start at whole groups.
  std::string next_bytes(std::uint64_t count) {
    if (!base64_) {
      if (count > data_.size()) fail("the file ends early");
      const std::string out(data_.substr(0, static_cast<std::size_t>(count)));
      data_.remove_prefix(static_cast<std::size_t>(count));
      return out;
    }
    if (count > data_.size()) fail("the file ends early");
    const std::size_t characters = (static_cast<std::size_t>(count) + 2) / 3 * 4;
    const auto bytes = decode_base64(data_.substr(0, characters));
    if (!bytes || bytes->size() < count) fail("broken base64 data");
    data_.remove_prefix(characters);
    return bytes->substr(0, static_cast<std::size_t>(count));
  }

  std::string read_plain() {
    const std::size_t header = size_of(encoding_.header);
    if (!base64_) return next_bytes(header_number(next_bytes(header), 0));
    // Length and data are one run.
    const std::string_view run = data_;
    const std::uint64_t size = header_number(next_bytes(header), 0);
    data_ = run;
    if (size > run.size()) fail("the file ends early");
    return next_bytes(header + size).substr(header);
  }

  /// Number of blocks, their size, the last one's size (0: full), then the compressed size of each.
  std::string read_compressed() {
    const std::size_t width = size_of(encoding_.header);
    const std::string_view run = data_;
    const std::uint64_t blocks = header_number(next_bytes(width), 0);
    data_ = run;
    if (blocks > run.size() / width) fail("declares more blocks than fit the file");
    const std::string header = next_bytes((3 + blocks) * width);
    const std::uint64_t block = header_number(header, 1), last = header_number(header, 2);
    if (blocks == 0) return {};
    const std::uint64_t limit = encoding_.memory_limit;
    if (block > limit || last > block || blocks > limit / std::max<std::uint64_t>(block, 1))
      throw ResourceLimit(encoding_.path + ": array '" + array_.name + "' inflates to more than " + std::to_string(limit) +
                          " bytes");

    std::uint64_t packed = 0;
    for (std::uint64_t i = 0; i < blocks; ++i) {
      const std::uint64_t size = header_number(header, static_cast<std::size_t>(3 + i));
      if (size > run.size()) fail("the file ends early");
      packed += size;
    }
    const std::string data = next_bytes(packed);
    std::string out;
    std::size_t at = 0;
    for (std::uint64_t i = 0; i < blocks; ++i) {
      const auto size = static_cast<std::size_t>(header_number(header, static_cast<std::size_t>(3 + i)));
      inflate_block(std::string_view(data).substr(at, size), i + 1 == blocks && last != 0 ? last : block, out);
      at += size;
    }
    return out;
  }

  void inflate_block(std::string_view packed, std::uint64_t size, std::string& out) const {
    constexpr std::uint64_t kDeflateLimit = 1032;  // nothing deflates better than this
    if (size > kDeflateLimit * packed.size() + kDeflateLimit) fail("a compressed block cannot be that large");
    const std::size_t start = out.size();
    out.resize(start + static_cast<std::size_t>(size));
    uLongf written = static_cast<uLongf>(size);
    const int status = uncompress(reinterpret_cast<Bytef*>(out.data() + start), &written,
                                  reinterpret_cast<const Bytef*>(packed.data()), static_cast<uLong>(packed.size()));
    if (status != Z_OK || written != size) fail("broken compressed data");
  }

  const VtkXmlArray& array_;
  const VtkXmlEncoding& encoding_;
  std::string_view data_;
  bool base64_ = false;
};

std::string_view trimmed(std::string_view s) {
  constexpr std::string_view kSpace = " \t\r\n";
  s.remove_prefix(std::min(s.find_first_not_of(kSpace), s.size()));
  while (!s.empty() && kSpace.find(s.back()) != kSpace.npos) s.remove_suffix(1);
  return s;
}

}  // namespace

std::optional<NumberType> vtk_xml_type(std::string_view name) {
  for (const auto& [word, type] : kTypes)
    if (word == name) return type;
  return std::nullopt;
}

std::string_view vtk_xml_name(NumberType type) {
  for (const auto& [word, t] : kTypes)
    if (t == type) return word;
  return {};
}

NumberArray decode(const VtkXmlArray& array, const VtkXmlEncoding& encoding) {
  ArrayDecoder decoder(array, encoding);
  if (array.format == "ascii") return decoder.decode_text();
  if (array.format == "binary") return decoder.decode_bytes(trimmed(array.content), true);
  if (array.format != "appended") throw IoError(encoding.path, "array '" + array.name + "' has an unknown format");
  if (array.offset > encoding.appended.size())
    throw IoError(encoding.path, "array '" + array.name + "' lies beyond the appended data");
  return decoder.decode_bytes(encoding.appended.substr(array.offset), encoding.appended_base64);
}

}  // namespace meniscus::io
