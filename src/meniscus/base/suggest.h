#pragma once

#include <span>
#include <string>
#include <string_view>

namespace meniscus {

/// The candidate that `word` is most likely a slip of; empty when none is near (more than a third of the letters differ).
std::string nearest_word(std::string_view word, std::span<const std::string_view> candidates);

/// " (did you mean 'radius'?)", or nothing.
std::string did_you_mean(std::string_view word, std::span<const std::string_view> candidates);

}  // namespace meniscus
