#pragma once

#include <meniscus/base/attributes.h>
#include <meniscus/io/attribute_names.h>
#include <meniscus/io/byte_cursor.h>

#include <span>
#include <string_view>
#include <variant>
#include <vector>

namespace meniscus::io {

/// An array of numbers as a file stores it: integers stay integers, the rest is double.
struct NumberArray {
  NumberType type = NumberType::Float64;
  std::vector<double> reals;
  std::vector<std::int64_t> integers;

  std::size_t size() const { return is_integer(type) ? integers.size() : reals.size(); }
};

/// Decodes the numbers in `bytes` (a multiple of the type's size).
NumberArray decode(std::string_view bytes, NumberType type, std::endian order);

/// The array as doubles, or as integers (fractions are cut off; what does not fit becomes -1).
std::vector<double> as_doubles(NumberArray array);
std::vector<std::int64_t> as_integers(NumberArray array);

/// Triples of numbers as positions; a rest of one or two is ignored.
std::vector<Vec3> as_positions(const NumberArray& array);

/// Adds the array as an attribute under its canonical name.
void add_attribute(Attributes& attributes, std::string_view name, std::size_t components, NumberArray array);

}  // namespace meniscus::io
