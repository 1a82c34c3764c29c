#pragma once

#include <meniscus/pointset/stroke.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace meniscus::scene {

/// A line of a script: a stroke, or the history's undo and redo.
struct SculptCommand {
  enum class Kind { Stroke, Undo, Redo };
  Kind kind = Kind::Stroke;
  pointset::Stroke stroke;
  std::string where;  ///< its place in the file, for messages
};

/// What `meniscus sculpt` does, in order. Format: docs/algorithms/sculpting.md and `meniscus schema sculpt`.
struct SculptScript {
  std::optional<double> spacing;  ///< wanted distance between points, world units
  std::vector<SculptCommand> commands;
};

/// Reads a script; comments are allowed, images are found relative to its folder. Throws IoError naming the line of a syntax
/// error or the place of a wrong or unknown key or of a stroke that cannot be done.
SculptScript load_sculpt_script(const std::string& path);
/// The same from text; `path` names it in errors.
SculptScript parse_sculpt_script(std::string_view text, const std::string& path);

}  // namespace meniscus::scene
