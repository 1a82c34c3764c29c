#include <meniscus/base/suggest.h>
#include <meniscus/scene/json_place.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace meniscus::scene {

void JsonPlace::fail(const std::string& reason) const {
  throw IoError(*file_, (path_.empty() ? "the document" : path_) + ": " + reason);
}

JsonPlace JsonPlace::at(std::string_view key) const {
  require_object();
  const auto it = value_->find(key);
  if (it == value_->end()) fail("'" + std::string(key) + "' is missing");
  return {*it, path_.empty() ? std::string(key) : path_ + "." + std::string(key), *file_};
}

JsonPlace JsonPlace::at(std::size_t index) const {
  return {(*value_)[index], path_ + "[" + std::to_string(index) + "]", *file_};
}

double JsonPlace::number() const {
  if (!value_->is_number()) fail("a number is expected, not " + std::string(value_->type_name()));
  const double v = value_->get<double>();
  if (!std::isfinite(v)) fail("the number is not finite");
  return v;
}

std::string JsonPlace::text() const {
  if (!value_->is_string()) fail("a string is expected, not " + std::string(value_->type_name()));
  return value_->get<std::string>();
}

Vec3 JsonPlace::vector() const {
  if (!value_->is_array() || value_->size() != 3) fail("three numbers are expected: [x, y, z]");
  return {at(std::size_t{0}).number(), at(std::size_t{1}).number(), at(std::size_t{2}).number()};
}

void JsonPlace::require_object() const {
  if (!value_->is_object()) fail("an object { … } is expected, not " + std::string(value_->type_name()));
}

void JsonPlace::require_array(std::size_t least) const {
  if (!value_->is_array()) fail("an array [ … ] is expected, not " + std::string(value_->type_name()));
  if (value_->size() < least) fail("at least " + std::to_string(least) + " entries are expected");
}

void JsonPlace::allow_keys(std::initializer_list<std::string_view> known) const {
  require_object();
  const std::vector<std::string_view> names(known);
  for (const auto& [key, value] : value_->items())
    if (key != "extras" && std::find(names.begin(), names.end(), key) == names.end())
      fail("unknown key '" + key + "'" + did_you_mean(key, names));
}

}  // namespace meniscus::scene
