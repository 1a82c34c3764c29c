#include <meniscus/base/suggest.h>
#include <meniscus/io/file_bytes.h>
#include <meniscus/scene/document.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

namespace meniscus::scene {
namespace {

constexpr double kMaxFrame = 1e9;
constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 30;

long frame_number(const JsonPlace& place) {
  const double v = place.number();
  if (v != std::floor(v) || std::abs(v) > kMaxFrame) place.fail("a frame number is expected");
  return static_cast<long>(v);
}

void check_params(const JsonPlace& params) {
  params.require_object();
  for (const auto& [name, value] : params.json().items()) {
    const JsonPlace p = params.at(name);
    p.allow_keys({"value", "min", "max", "unit"});
    const double v = p.at("value").number();
    if (p.has("min") && v < p.at("min").number()) p.fail("value lies below min");
    if (p.has("max") && v > p.at("max").number()) p.fail("value lies above max");
    if (p.has("unit")) p.at("unit").text();
  }
}

}  // namespace

Document Document::load(const std::string& path) { return parse(io::load_file(path, kMaxBytes), path); }

Document Document::parse(std::string_view text, const std::string& path) {
  Document d;
  d.path_ = path;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  try {
    d.json_ = nlohmann::json::parse(text, nullptr, true, true);
  } catch (const nlohmann::json::parse_error& e) {
    const auto until = text.substr(0, std::min<std::size_t>(e.byte, text.size()));
    const auto line = 1 + static_cast<std::uint64_t>(std::count(until.begin(), until.end(), '\n'));
    throw IoError(path, "this is not JSON: " + std::string(e.what()), FilePlace::line(line));
  }

  const JsonPlace root = d.root();
  root.allow_keys({"format", "version", "fps", "range", "params", "surface", "units", "$schema"});
  if (root.at("format").text() != "meniscus.scene") root.at("format").fail("\"meniscus.scene\" is expected");
  if (root.at("version").number() != 1) root.at("version").fail("this program reads version 1");
  if (root.has("fps")) {
    d.fps_ = root.at("fps").number();
    if (d.fps_ <= 0) root.at("fps").fail("frames per second must be above zero");
  }
  if (root.has("range")) {
    const JsonPlace range = root.at("range");
    range.require_array(2);
    d.first_ = frame_number(range.at(std::size_t{0}));
    d.last_ = frame_number(range.at(std::size_t{1}));
    if (d.last_ < d.first_) range.fail("the last frame comes before the first");
  }
  if (root.has("params")) check_params(root.at("params"));
  root.at("surface").require_object();
  return d;
}

void Document::set_parameter(const std::string& name, double value) {
  std::vector<std::string> names;
  if (json_.contains("params"))
    for (const auto& [key, entry] : json_["params"].items()) names.push_back(key);
  if (std::find(names.begin(), names.end(), name) == names.end()) {
    const std::vector<std::string_view> views(names.begin(), names.end());
    throw InvalidInput(path_ + " has no parameter '" + name + "'" + did_you_mean(name, views));
  }
  nlohmann::json& entry = json_["params"][name];
  const double before = entry["value"].get<double>();
  entry["value"] = value;
  try {
    check_params(root().at("params"));
  } catch (const IoError& e) {
    entry["value"] = before;
    throw InvalidInput(e.what());
  }
}

void Document::set_number(const nlohmann::json::json_pointer& place, double value) {
  if (!json_.contains(place) || !json_[place].is_number())
    throw InvalidInput(path_ + " has no number at '" + place.to_string() + "'");
  json_[place] = value;
}

std::string Document::resolve(const std::string& file) const {
  const std::filesystem::path p(file);
  if (p.is_absolute() || path_ == "-") return file;
  return (std::filesystem::path(path_).parent_path() / p).lexically_normal().string();
}

}  // namespace meniscus::scene
