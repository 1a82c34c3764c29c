#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace meniscus::io {

/// Base64 with padding, as VTK's XML files hold binary data.
std::string encode_base64(std::string_view bytes);

/// Decodes whole groups of four up to the end or to a group with padding, whichever comes first; `used` counts the
/// characters taken. White space between characters is not allowed. Nothing for characters outside the alphabet.
std::optional<std::string> decode_base64(std::string_view text, std::size_t* used = nullptr);

}  // namespace meniscus::io
