#pragma once

#include <meniscus/base/error.h>
#include <meniscus/base/vec.h>

#include <nlohmann/json.hpp>

#include <initializer_list>
#include <string>
#include <string_view>

namespace meniscus::scene {

/// A value in a JSON document together with where it stands, for errors that name the place ("surface.items[2].radius").
/// A view: the document must outlive it.
class JsonPlace {
 public:
  JsonPlace(const nlohmann::json& value, std::string path, const std::string& file)
      : value_(&value), path_(std::move(path)), file_(&file) {}

  const nlohmann::json& json() const { return *value_; }
  const std::string& path() const { return path_; }
  const std::string& file() const { return *file_; }

  bool has(std::string_view key) const { return value_->is_object() && value_->contains(key); }
  /// A member that must be there.
  JsonPlace at(std::string_view key) const;
  JsonPlace at(std::size_t index) const;
  std::size_t size() const { return value_->size(); }

  double number() const;
  std::string text() const;
  /// Three numbers.
  Vec3 vector() const;
  void require_object() const;
  void require_array(std::size_t least = 0) const;
  /// Throws if this object has a key that is none of `known` (apart from "extras"), with a suggestion.
  void allow_keys(std::initializer_list<std::string_view> known) const;

  /// Throws IoError: "file: place: reason".
  [[noreturn]] void fail(const std::string& reason) const;

 private:
  const nlohmann::json* value_;
  std::string path_;
  const std::string* file_;
};

}  // namespace meniscus::scene
