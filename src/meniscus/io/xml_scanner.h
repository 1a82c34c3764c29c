#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace meniscus::io {

/// A start tag, an empty tag or an end tag.
struct XmlTag {
  std::string_view name;
  std::vector<std::pair<std::string_view, std::string_view>> attributes;
  bool opens = true;    ///< <a> and <a/>
  bool closes = false;  ///< </a> and <a/>

  std::optional<std::string_view> find(std::string_view attribute) const;
};

/// Walks over the tags of an XML text in memory; comments, declarations and processing instructions are skipped. Knows just
/// enough for VTK's files: no entities beyond the five, no DTD, no CDATA.
class XmlScanner {
 public:
  XmlScanner(std::string_view text, std::string path) : text_(text), path_(std::move(path)) {}

  /// Next tag; nothing at the end of the text.
  std::optional<XmlTag> next();
  /// Text from the last tag to the next '<'.
  std::string_view content() const;
  /// Everything after the last tag.
  std::string_view rest() const { return text_.substr(position_); }

  [[noreturn]] void fail(const std::string& reason) const;

 private:
  bool skip_to_tag();
  void read_attributes(std::string_view inside, XmlTag& tag) const;

  std::string_view text_;
  std::string path_;
  std::size_t position_ = 0;
};

/// The five predefined entities, both ways.
std::string xml_unescaped(std::string_view text);
std::string xml_escaped(std::string_view text);

}  // namespace meniscus::io
