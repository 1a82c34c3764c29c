#include <meniscus/io/number_array.h>

#include <cmath>

namespace meniscus::io {
namespace {

template <class T>
void decode_into(std::string_view bytes, std::endian order, NumberArray& out) {
  const std::size_t count = bytes.size() / sizeof(T);
  if constexpr (std::is_integral_v<T>) {
    out.integers.resize(count);
    for (std::size_t i = 0; i < count; ++i)
      out.integers[i] = static_cast<std::int64_t>(load<T>(bytes.data() + i * sizeof(T), order));
  } else {
    out.reals.resize(count);
    for (std::size_t i = 0; i < count; ++i) out.reals[i] = static_cast<double>(load<T>(bytes.data() + i * sizeof(T), order));
  }
}

}  // namespace

NumberArray decode(std::string_view bytes, NumberType type, std::endian order) {
  NumberArray out;
  out.type = type;
  switch (type) {
    case NumberType::Int8: decode_into<std::int8_t>(bytes, order, out); break;
    case NumberType::UInt8: decode_into<std::uint8_t>(bytes, order, out); break;
    case NumberType::Int16: decode_into<std::int16_t>(bytes, order, out); break;
    case NumberType::UInt16: decode_into<std::uint16_t>(bytes, order, out); break;
    case NumberType::Int32: decode_into<std::int32_t>(bytes, order, out); break;
    case NumberType::UInt32: decode_into<std::uint32_t>(bytes, order, out); break;
    case NumberType::Int64: decode_into<std::int64_t>(bytes, order, out); break;
    case NumberType::UInt64: decode_into<std::uint64_t>(bytes, order, out); break;
    case NumberType::Float32: decode_into<float>(bytes, order, out); break;
    case NumberType::Float64: decode_into<double>(bytes, order, out); break;
  }
  return out;
}

std::vector<double> as_doubles(NumberArray array) {
  if (!is_integer(array.type)) return std::move(array.reals);
  return std::vector<double>(array.integers.begin(), array.integers.end());
}

std::vector<std::int64_t> as_integers(NumberArray array) {
  if (is_integer(array.type)) return std::move(array.integers);
  std::vector<std::int64_t> out(array.reals.size());
  constexpr double kLimit = 9.2e18;
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = std::abs(array.reals[i]) < kLimit ? static_cast<std::int64_t>(array.reals[i]) : -1;
  return out;
}

std::vector<Vec3> as_positions(const NumberArray& array) {
  std::vector<Vec3> out(array.size() / 3);
  for (std::size_t i = 0; i < out.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c)
      out[i][static_cast<int>(c)] =
          is_integer(array.type) ? static_cast<double>(array.integers[3 * i + c]) : array.reals[3 * i + c];
  return out;
}

void add_attribute(Attributes& attributes, std::string_view name, std::size_t components, NumberArray array) {
  if (is_integer(array.type))
    add_attribute(attributes, name, components, std::move(array.integers), array.type);
  else
    add_attribute(attributes, name, components, std::move(array.reals), array.type);
}

}  // namespace meniscus::io
