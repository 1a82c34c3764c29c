#pragma once

#include <meniscus/base/error.h>

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

namespace meniscus::io {

template <class T>
T swap_bytes(T value) {
  if constexpr (sizeof(T) == 1)
    return value;
  else if constexpr (sizeof(T) == 2)
    return std::bit_cast<T>(__builtin_bswap16(std::bit_cast<std::uint16_t>(value)));
  else if constexpr (sizeof(T) == 4)
    return std::bit_cast<T>(__builtin_bswap32(std::bit_cast<std::uint32_t>(value)));
  else
    return std::bit_cast<T>(__builtin_bswap64(std::bit_cast<std::uint64_t>(value)));
}

/// The number at `bytes`, which need not be aligned, stored in the given order.
template <class T>
T load(const char* bytes, std::endian order) {
  static_assert(std::is_arithmetic_v<T>);
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return order == std::endian::native ? value : swap_bytes(value);
}

/// Reads numbers from bytes in memory; never past their end. Does not own them.
class ByteCursor {
 public:
  ByteCursor(std::string_view bytes, std::string path, std::endian order, std::size_t position = 0)
      : bytes_(bytes), path_(std::move(path)), order_(order), position_(position) {}

  std::size_t position() const { return position_; }
  std::size_t remaining() const { return bytes_.size() - position_; }
  std::endian order() const { return order_; }

  template <class T>
  T read() {
    return load<T>(take(sizeof(T)).data(), order_);
  }

  std::string_view take(std::uint64_t count) {
    if (count > remaining())
      fail("the file ends early: " + std::to_string(count) + " bytes wanted, " + std::to_string(remaining()) + " left");
    const std::string_view out = bytes_.substr(position_, static_cast<std::size_t>(count));
    position_ += static_cast<std::size_t>(count);
    return out;
  }

  /// Throws unless `count` items of `bytes_each` bytes can still follow. Call before allocating for them.
  void require(std::uint64_t count, std::uint64_t bytes_each, std::string_view what) const {
    if (bytes_each != 0 && count > remaining() / bytes_each)
      fail("declares " + std::to_string(count) + " " + std::string(what) + ", but only " + std::to_string(remaining()) +
           " bytes follow");
  }

  [[noreturn]] void fail(const std::string& reason) const { throw IoError(path_, reason, FilePlace::byte(position_)); }

 private:
  std::string_view bytes_;
  std::string path_;
  std::endian order_;
  std::size_t position_;
};

}  // namespace meniscus::io
