#include <meniscus/io/text_scanner.h>

#include <algorithm>
#include <charconv>
#include <limits>
#include <system_error>

namespace meniscus::io {
namespace {

bool blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }
bool line_end(char c) { return c == '\n' || c == '\r'; }

/// from_chars says "out of range" for 1e400 and for 1e-400 alike: the decimal exponent of the first digit that counts
/// decides.
double out_of_range_value(std::string_view word) {
  const bool negative = word.front() == '-';
  const std::size_t e = std::min(word.find_first_of("eE"), word.size());
  const std::string_view mantissa = word.substr(0, e);
  const std::size_t point = std::min(mantissa.find('.'), mantissa.size());
  const std::size_t first = mantissa.find_first_of("123456789");
  long long exponent = 0;
  if (e < word.size()) {
    std::string_view digits = word.substr(e + 1);
    if (digits.starts_with('+')) digits.remove_prefix(1);
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), exponent);
    constexpr long long kHuge = 1'000'000'000'000;
    if (error != std::errc{} || exponent > kHuge || exponent < -kHuge) exponent = digits.starts_with('-') ? -kHuge : kHuge;
  }
  const long long magnitude = static_cast<long long>(point) - static_cast<long long>(first) + exponent;
  if (magnitude < 0) return negative ? -0.0 : 0.0;
  return negative ? -std::numeric_limits<double>::infinity() : std::numeric_limits<double>::infinity();
}

std::string quoted(std::string_view word) {
  std::string out = "'";
  for (const char c : word.substr(0, 40)) out += c >= ' ' && c < 127 ? c : '?';
  return out + (word.size() > 40 ? "…'" : "'");
}

}  // namespace

bool parse_number(std::string_view word, double& value) {
  if (word.starts_with('+') && word.size() > 1 && word[1] != '-' && word[1] != '+') word.remove_prefix(1);
  if (word.empty()) return false;
  const char* end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, value);
  if (stop != end) return false;
  if (error == std::errc::result_out_of_range) {
    value = out_of_range_value(word);
    return true;
  }
  return error == std::errc{};
}

bool parse_integer(std::string_view word, std::int64_t& value) {
  if (word.starts_with('+') && word.size() > 1 && word[1] != '-') word.remove_prefix(1);
  const char* end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, value);
  return stop == end && error == std::errc{};
}

TextScanner::TextScanner(std::string_view text, std::string path) : text_(text), path_(std::move(path)) {
  if (text_.starts_with("\xEF\xBB\xBF")) position_ = 3;
}

bool TextScanner::at_line_end() {
  while (position_ < text_.size() && blank(text_[position_])) ++position_;
  return position_ == text_.size() || line_end(text_[position_]);
}

void TextScanner::end_line() {
  if (position_ == text_.size()) return;
  const bool carriage_return = text_[position_++] == '\r';
  if (carriage_return && position_ < text_.size() && text_[position_] == '\n') ++position_;
  ++line_;
}

void TextScanner::next_line() {
  while (position_ < text_.size() && !line_end(text_[position_])) ++position_;
  end_line();
}

bool TextScanner::skip_space() {
  while (at_line_end()) {
    if (at_end()) return false;
    end_line();
  }
  return true;
}

std::string_view TextScanner::word() {
  if (at_line_end()) return {};
  const std::size_t begin = position_;
  while (position_ < text_.size() && !blank(text_[position_]) && !line_end(text_[position_])) ++position_;
  return text_.substr(begin, position_ - begin);
}

std::string_view TextScanner::rest_of_line() {
  if (at_line_end()) return {};
  const std::size_t begin = position_;
  while (position_ < text_.size() && !line_end(text_[position_])) ++position_;
  std::string_view rest = text_.substr(begin, position_ - begin);
  while (!rest.empty() && blank(rest.back())) rest.remove_suffix(1);
  return rest;
}

double TextScanner::number() {
  const std::string_view w = word();
  double value = 0;
  if (parse_number(w, value)) return value;
  if (w.empty()) fail("a number is missing");
  if (w.find(',') != w.npos) fail("not a number: " + quoted(w) + " (numbers use a decimal point)");
  fail("not a number: " + quoted(w));
}

std::int64_t TextScanner::integer() {
  const std::string_view w = word();
  std::int64_t value = 0;
  if (parse_integer(w, value)) return value;
  if (w.empty()) fail("a number is missing");
  fail("not an integer: " + quoted(w));
}

std::uint64_t TextScanner::count() {
  const std::int64_t value = integer();
  if (value < 0) fail("a count is negative: " + std::to_string(value));
  return static_cast<std::uint64_t>(value);
}

void TextScanner::require(std::uint64_t count, std::uint64_t bytes_each, std::string_view what) const {
  // One byte of grace: the last number of a text needs no separator after it.
  if (bytes_each != 0 && count > (remaining() + 1) / bytes_each)
    fail("declares " + std::to_string(count) + " " + std::string(what) + ", but only " + std::to_string(remaining()) +
         " bytes follow");
}

std::string_view TextScanner::take(std::uint64_t bytes) {
  if (bytes > remaining())
    fail("the file ends early: " + std::to_string(bytes) + " bytes wanted, " + std::to_string(remaining()) + " left");
  const std::string_view out = text_.substr(position_, static_cast<std::size_t>(bytes));
  seek(position_ + static_cast<std::size_t>(bytes));
  return out;
}

void TextScanner::seek(std::size_t position) {
  position_ = position;
  binary_ = true;
}

void TextScanner::seek_line(std::size_t position) {
  line_ += static_cast<std::uint64_t>(std::count(text_.begin() + static_cast<std::ptrdiff_t>(position_),
                                                 text_.begin() + static_cast<std::ptrdiff_t>(position), '\n'));
  position_ = position;
}

void TextScanner::fail(const std::string& reason) const {
  throw IoError(path_, reason, binary_ ? FilePlace::byte(position_) : FilePlace::line(line_));
}

}  // namespace meniscus::io
