#pragma once

#include <string_view>

namespace meniscus::scene {

/// The JSON schema (draft 7) of scene files. What it accepts Document and build_field accept too, up to what a schema cannot
/// say (ranges across keys, files that exist).
std::string_view scene_schema();

/// The JSON schema (draft 7) of scripts of strokes that SculptScript reads.
std::string_view sculpt_schema();

}  // namespace meniscus::scene
