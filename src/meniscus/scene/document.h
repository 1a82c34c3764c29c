#pragma once

#include <meniscus/scene/json_place.h>

#include <nlohmann/json.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace meniscus::scene {

/// A scene file in memory: the JSON as read, so that unknown `extras` and the author's order survive, and its checked
/// header. Format: docs/scene.md and `meniscus schema`.
class Document {
 public:
  /// Reads a scene file; comments are allowed. Throws IoError naming the line of a syntax error, or the place of a wrong or
  /// unknown key.
  static Document load(const std::string& path);
  /// The same from text; `path` names it in errors, and relative file names in the scene start from its folder.
  static Document parse(std::string_view text, const std::string& path);

  const std::string& path() const { return path_; }
  const nlohmann::json& json() const { return json_; }
  JsonPlace root() const { return {json_, "", path_}; }

  double frames_per_second() const { return fps_; }
  long first_frame() const { return first_; }
  long last_frame() const { return last_; }
  /// Seconds at a frame: frame / fps.
  double time_of(long frame) const { return static_cast<double>(frame) / fps_; }

  /// Gives an entry of "params" a new value. Throws InvalidInput for an unknown name, with a suggestion, or a value out of
  /// the parameter's range.
  void set_parameter(const std::string& name, double value);
  /// Replaces the number at `place`. Throws InvalidInput when there is none.
  void set_number(const nlohmann::json::json_pointer& place, double value);

  /// `file` as the scene means it: relative to the folder of the scene file.
  std::string resolve(const std::string& file) const;

 private:
  nlohmann::json json_;
  std::string path_;
  double fps_ = 24;
  long first_ = 1;
  long last_ = 1;
};

}  // namespace meniscus::scene
