#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace meniscus::io {

/// The bytes of a file, inflated if they are gzip; "-" is standard input, which may be read again. Throws IoError (missing,
/// a folder, unreadable, broken gzip) or ResourceLimit when they are more than `limit`, or when gzip claims to shrink them
/// more than 400-fold.
std::string load_file(const std::string& path, std::uint64_t limit);

/// The bytes of a file as they are, gzip or not.
std::string load_plain_file(const std::string& path, std::uint64_t limit);

/// Whether the bytes start like gzip.
bool is_gzip(std::string_view bytes);

/// Whether the file starts like gzip.
bool begins_with_gzip(const std::string& path);

/// Adds the positions of every line that starts with `mark`, reading the file once in pieces; returns its size.
std::uint64_t scan_file(const std::string& path, std::string_view mark, std::vector<std::uint64_t>& positions);

/// `size` bytes of a plain file from `begin` on; errors as load_file.
std::string load_part(const std::string& path, std::uint64_t begin, std::uint64_t size, std::uint64_t limit);

/// Inflates all members of a gzip stream; errors as load_file.
std::string inflate_gzip(std::string_view bytes, const std::string& path, std::uint64_t limit);

}  // namespace meniscus::io
