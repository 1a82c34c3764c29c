#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace meniscus::io {

/// The bytes of a file, inflated if they are gzip; "-" is standard input. Throws IoError (missing, a folder, unreadable,
/// broken gzip) or ResourceLimit when they are more than `limit`, or when gzip claims to shrink them more than 400-fold.
std::string load_file(const std::string& path, std::uint64_t limit);

/// Whether the bytes start like gzip.
bool is_gzip(std::string_view bytes);

/// Inflates all members of a gzip stream; errors as load_file.
std::string inflate_gzip(std::string_view bytes, const std::string& path, std::uint64_t limit);

}  // namespace meniscus::io
