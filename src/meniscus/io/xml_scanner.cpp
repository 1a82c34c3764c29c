#include <meniscus/base/error.h>
#include <meniscus/io/xml_scanner.h>

#include <algorithm>
#include <array>

namespace meniscus::io {
namespace {

constexpr std::string_view kSpace = " \t\r\n";

constexpr std::array<std::pair<char, std::string_view>, 5> kEntities = {
    {{'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}, {'\'', "&apos;"}}};

void skip_spaces(std::string_view& s) { s.remove_prefix(std::min(s.find_first_not_of(kSpace), s.size())); }

}  // namespace

std::optional<std::string_view> XmlTag::find(std::string_view attribute) const {
  for (const auto& [name_, value] : attributes)
    if (name_ == attribute) return value;
  return std::nullopt;
}

bool XmlScanner::skip_to_tag() {
  for (;;) {
    position_ = std::min(text_.find('<', position_), text_.size());
    const std::string_view here = text_.substr(position_);
    if (here.empty()) return false;
    std::string_view end;
    if (here.starts_with("<!--"))
      end = "-->";
    else if (here.starts_with("<?"))
      end = "?>";
    else if (here.starts_with("<!"))
      end = ">";
    else
      return true;
    const std::size_t at = here.find(end);
    if (at == here.npos) fail("a comment or declaration does not end");
    position_ += at + end.size();
  }
}

std::optional<XmlTag> XmlScanner::next() {
  if (!skip_to_tag()) return std::nullopt;
  const std::size_t end = text_.find('>', position_);
  if (end == text_.npos) fail("a tag does not end");
  std::string_view inside = text_.substr(position_ + 1, end - position_ - 1);
  XmlTag tag;
  if (inside.starts_with('/')) {
    tag.opens = false;
    tag.closes = true;
    inside.remove_prefix(1);
  } else if (inside.ends_with('/')) {
    tag.closes = true;
    inside.remove_suffix(1);
  }
  const std::size_t name_end = std::min(inside.find_first_of(kSpace), inside.size());
  tag.name = inside.substr(0, name_end);
  if (tag.name.empty()) fail("a tag without a name");
  read_attributes(inside.substr(name_end), tag);
  position_ = end + 1;
  return tag;
}

void XmlScanner::read_attributes(std::string_view inside, XmlTag& tag) const {
  for (skip_spaces(inside); !inside.empty(); skip_spaces(inside)) {
    const std::size_t equals = inside.find('=');
    if (equals == inside.npos) fail("an attribute without a value");
    std::string_view name = inside.substr(0, equals);
    name = name.substr(0, std::min(name.find_first_of(kSpace), name.size()));
    inside.remove_prefix(equals + 1);
    skip_spaces(inside);
    if (inside.empty() || (inside.front() != '"' && inside.front() != '\'')) fail("an attribute's value is not quoted");
    const std::size_t end = inside.find(inside.front(), 1);
    if (end == inside.npos) fail("an attribute's value does not end");
    if (tag.attributes.size() == 1000) fail("more than 1000 attributes in a tag");
    tag.attributes.emplace_back(name, inside.substr(1, end - 1));
    inside.remove_prefix(end + 1);
  }
}

std::string_view XmlScanner::content() const {
  return text_.substr(position_, std::min(text_.find('<', position_), text_.size()) - position_);
}

void XmlScanner::fail(const std::string& reason) const { throw IoError(path_, reason, FilePlace::byte(position_)); }

std::string xml_unescaped(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const std::string_view rest = text.substr(i);
    const auto entity =
        std::find_if(kEntities.begin(), kEntities.end(), [&](const auto& e) { return rest.starts_with(e.second); });
    if (entity == kEntities.end()) {
      out += text[i++];
    } else {
      out += entity->first;
      i += entity->second.size();
    }
  }
  return out;
}

std::string xml_escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    const auto entity = std::find_if(kEntities.begin(), kEntities.end(), [&](const auto& e) { return e.first == c; });
    if (entity != kEntities.end())
      out += entity->second;
    else
      out += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
  }
  return out;
}

}  // namespace meniscus::io
