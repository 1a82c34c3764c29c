#pragma once

#include <meniscus/base/error.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace meniscus::io {

/// Reads words and numbers from text in memory, the same on every machine (no locale). Lines end with LF, CRLF or CR; blanks
/// are spaces and tabs; a byte-order mark is skipped. Knows its line for errors. Does not own the text.
class TextScanner {
 public:
  TextScanner(std::string_view text, std::string path);

  bool at_end() const { return position_ == text_.size(); }
  std::size_t position() const { return position_; }
  std::size_t remaining() const { return text_.size() - position_; }
  /// 1-based number of the line the scanner is in.
  std::uint64_t line() const { return line_; }

  /// Skips blanks; true when the line (or the text) ends here.
  bool at_line_end();
  /// Goes to the start of the next line, whatever is left of this one.
  void next_line();
  /// Skips blanks and line ends; false at the end of the text.
  bool skip_space();

  /// Whether the text goes on with `text`, right here.
  bool next_is(std::string_view text) const { return text_.substr(position_).starts_with(text); }

  /// Next run of non-blank bytes of this line; empty at its end.
  std::string_view word();
  /// What is left of this line, without its end; the scanner then stands at that end.
  std::string_view rest_of_line();

  /// Next word of this line as a number. "inf", "nan" and 1e400 (inf) are accepted, 1e-400 is 0; trailing rubbish (a decimal
  /// comma, say) is an error that quotes the word.
  double number();
  /// Next word as an integer; a fraction or an overflow is an error.
  std::int64_t integer();
  /// Next word as a count; negative is an error.
  std::uint64_t count();

  /// Throws unless `count` items of at least `bytes_each` bytes can still follow.
  void require(std::uint64_t count, std::uint64_t bytes_each, std::string_view what) const;
  /// Raw bytes from here on, for formats that mix text and binary data; throws when fewer are left.
  std::string_view take(std::uint64_t bytes);
  /// Moves to an earlier or later position; lines are no longer counted right, so errors give bytes from now on.
  void seek(std::size_t position);

  /// Moves to the start of a later line; lines go on being counted.
  void seek_line(std::size_t position);

  [[noreturn]] void fail(const std::string& reason) const;

 private:
  void end_line();

  std::string_view text_;
  std::string path_;
  std::size_t position_ = 0;
  std::uint64_t line_ = 1;
  bool binary_ = false;
};

/// A whole word as a number, as TextScanner::number does; false if it is none.
bool parse_number(std::string_view word, double& value);
bool parse_integer(std::string_view word, std::int64_t& value);

}  // namespace meniscus::io
