#include <meniscus/base/error.h>
#include <meniscus/io/atomic_file.h>
#include <meniscus/io/file_bytes.h>
#include <meniscus/io/manifest.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdint>

namespace meniscus::io {
namespace {

constexpr std::string_view kFormat = "meniscus.manifest";
constexpr std::uint64_t kLargestFrame = 1ull << 40;

std::uint64_t mixed(std::uint64_t h) {
  h = (h ^ (h >> 33)) * 0xFF51AFD7ED558CCDull;
  h = (h ^ (h >> 33)) * 0xC4CEB9FE1A85EC53ull;
  return h ^ (h >> 33);
}

std::string folder_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  return slash == path.npos ? "" : path.substr(0, slash + 1);
}

std::string name_of(const std::string& path) { return path.substr(folder_of(path).size()); }

/// The text of a member, or nothing.
std::string text(const nlohmann::json& object, const char* key) {
  const auto at = object.find(key);
  return at != object.end() && at->is_string() ? at->get<std::string>() : "";
}

}  // namespace

std::string fingerprint(std::string_view bytes) {
  // Two independent chains over 8-byte words; the last word is padded and the length closes both.
  std::uint64_t a = 0x9E3779B97F4A7C15ull, b = 0xD1B54A32D192ED03ull;
  const auto add = [&](std::uint64_t word) {
    a = mixed(a ^ word);
    b = mixed(b + word * 0x2545F4914F6CDD1Dull);
  };
  for (std::size_t i = 0; i < bytes.size(); i += 8) {
    std::uint64_t word = 0;
    for (std::size_t k = std::min<std::size_t>(8, bytes.size() - i); k-- > 0;)
      word = word << 8 | static_cast<unsigned char>(bytes[i + k]);
    add(word);
  }
  add(bytes.size());
  std::string out;
  for (const std::uint64_t h : {a, b})
    for (int shift = 60; shift >= 0; shift -= 4) out += "0123456789abcdef"[h >> shift & 15];
  return out;
}

std::string fingerprint_of_file(const std::string& path) {
  try {
    return fingerprint(load_plain_file(path, kLargestFrame));
  } catch (const IoError&) {
    return {};
  }
}

Manifest::Manifest(std::string path, std::string_view settings) : path_(std::move(path)), settings_(fingerprint(settings)) {}

std::size_t Manifest::resume() {
  frames_.clear();
  std::string content;
  try {
    content = load_plain_file(path_, 1 << 30);
  } catch (const Error&) {
    return 0;
  }
  const auto json = nlohmann::json::parse(content, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object() || text(json, "format") != kFormat || text(json, "settings") != settings_) return 0;
  const auto list = json.find("frames");
  if (list == json.end() || !list->is_array()) return 0;
  for (const auto& item : *list) {
    if (!item.is_object() || !item.contains("frame") || !item["frame"].is_number_integer()) continue;
    Entry entry{text(item, "file"), text(item, "hash"), item};
    for (const char* own : {"frame", "file", "hash"}) entry.about.erase(own);
    if (entry.file.empty() || entry.file.find('/') != entry.file.npos || entry.hash.empty()) continue;
    if (fingerprint_of_file(folder_of(path_) + entry.file) == entry.hash) frames_[item["frame"].get<long>()] = entry;
  }
  return frames_.size();
}

void Manifest::add(long frame, const std::string& file, const WriteOptions& options, nlohmann::json about) {
  frames_[frame] = {name_of(file), fingerprint(load_plain_file(file, kLargestFrame)), std::move(about)};
  write(options);
}

void Manifest::write(const WriteOptions& options) const {
  nlohmann::ordered_json json = {
      {"format", kFormat}, {"version", 1}, {"settings", settings_}, {"frames", nlohmann::ordered_json::array()}};
  for (const auto& [frame, entry] : frames_) {
    nlohmann::ordered_json item{{"frame", frame}, {"file", entry.file}, {"hash", entry.hash}};
    for (const auto& [key, value] : entry.about.items()) item[key] = value;
    json["frames"].push_back(std::move(item));
  }
  WriteOptions replacing = options;
  replacing.overwrite = true;
  write_file(path_, json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n", replacing);
}

std::string manifest_path(const std::string& pattern) {
  const std::string folder = folder_of(pattern);
  std::string stem = name_of(pattern);
  stem = stem.substr(0, std::min(stem.find_first_of("#%{$"), stem.rfind('.')));
  while (!stem.empty() && (stem.back() == '.' || stem.back() == '_' || stem.back() == '-')) stem.pop_back();
  return folder + (stem.empty() ? "frames" : stem) + ".manifest.json";
}

}  // namespace meniscus::io
