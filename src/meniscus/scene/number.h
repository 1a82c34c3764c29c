#pragma once

#include <meniscus/field/parameter.h>
#include <meniscus/scene/json_place.h>

#include <string>
#include <vector>

namespace meniscus::scene {

/// Reads the numbers of one node: literals, {"param": name}, curves and {"expr": "..."}. Knows the scene's parameters and
/// what the node freezes.
class NumberReader {
 public:
  /// `params` is the scene's "params" object, or null; `node` the leaf whose "freeze" list applies.
  NumberReader(const nlohmann::json* params, const JsonPlace& node);

  /// The number at `place`; `path` is its place within the node ("items[2].radius"), matched against "freeze", of which an
  /// entry freezes what it names and all below.
  field::Number number(const JsonPlace& place, const std::string& path) const;
  field::Number3 vector(const JsonPlace& place, const std::string& path) const;

  /// A member of `parent`, or a frozen default when it is not given.
  field::Number member(const JsonPlace& parent, std::string_view key, const std::string& prefix, double otherwise) const;
  field::Number member(const JsonPlace& parent, std::string_view key, const std::string& prefix) const;
  field::Number3 vector_member(const JsonPlace& parent, std::string_view key, const std::string& prefix) const;
  field::Number3 vector_member(const JsonPlace& parent, std::string_view key, const std::string& prefix,
                               const Vec3& otherwise) const;

 private:
  bool is_frozen(const std::string& path) const;
  field::Number named(const JsonPlace& place) const;

  const nlohmann::json* params_;
  std::vector<std::string> frozen_;
};

}  // namespace meniscus::scene
