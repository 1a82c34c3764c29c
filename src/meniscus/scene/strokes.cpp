#include <meniscus/base/error.h>
#include <meniscus/io/file_bytes.h>
#include <meniscus/scene/json_place.h>
#include <meniscus/scene/strokes.h>

#include <nlohmann/json.hpp>

#include <algorithm>

namespace meniscus::scene {
namespace {

constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 28;

std::vector<Vec3> read_points(const JsonPlace& list, std::size_t least) {
  list.require_array(least);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < list.size(); ++i) points.push_back(list.at(i).vector());
  return points;
}

std::vector<double> read_times(const JsonPlace& list, std::size_t places) {
  list.require_array();
  if (list.size() != places) list.fail("one time for each place of the path is expected");
  std::vector<double> times;
  for (std::size_t i = 0; i < places; ++i) {
    times.push_back(list.at(i).number());
    if (i == 0 ? times[0] != 0 : !(times[i] > times[i - 1])) list.at(i).fail("times start at 0 and rise");
  }
  return times;
}

Drag read_drag(const JsonPlace& place, double seconds) {
  place.require_object();
  place.allow_keys({"path", "times", "sideways"});
  Drag drag;
  drag.path = read_points(place.at("path"), 2);
  drag.times = place.has("times") ? read_times(place.at("times"), drag.path.size()) : even_times(drag.path.size(), seconds);
  if (place.has("sideways")) {
    if (!place.at("sideways").json().is_boolean()) place.at("sideways").fail("true or false is expected");
    drag.sideways = place.at("sideways").json().get<bool>();
  }
  return drag;
}

Stroke read_stroke(const JsonPlace& place) {
  place.require_object();
  place.allow_keys({"label", "seconds", "drags", "pins", "freeze"});
  Stroke stroke;
  if (place.has("label")) stroke.label = place.at("label").text();
  const double seconds = place.has("seconds") ? place.at("seconds").number() : 1;
  if (!(seconds > 0)) place.at("seconds").fail("a number above zero is expected");
  const JsonPlace drags = place.at("drags");
  drags.require_array(1);
  for (std::size_t i = 0; i < drags.size(); ++i) stroke.drags.push_back(read_drag(drags.at(i), seconds));
  if (place.has("pins")) stroke.pins = read_points(place.at("pins"), 0);
  if (place.has("freeze")) {
    place.at("freeze").require_array();
    for (std::size_t i = 0; i < place.at("freeze").size(); ++i) stroke.freeze.push_back(place.at("freeze").at(i).text());
  }
  return stroke;
}

}  // namespace

Vec3 Drag::at(double t) const {
  std::size_t k = 1;
  while (k < times.size() && times[k] <= t) ++k;
  if (k >= times.size()) return path.back();
  const double share = std::clamp((t - times[k - 1]) / (times[k] - times[k - 1]), 0.0, 1.0);
  return path[k - 1] + share * (path[k] - path[k - 1]);
}

double Stroke::seconds() const {
  double last = 0;
  for (const Drag& d : drags) last = std::max(last, d.times.back());
  return last;
}

std::vector<double> Stroke::knots() const {
  std::vector<double> all;
  for (const Drag& d : drags) all.insert(all.end(), d.times.begin() + 1, d.times.end());
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

std::vector<double> even_times(std::size_t places, double seconds) {
  std::vector<double> times;
  for (std::size_t i = 0; i < places; ++i)
    times.push_back(seconds * static_cast<double>(i) / static_cast<double>(places - 1));
  return times;
}

std::vector<Stroke> read_strokes(const std::string& path) {
  nlohmann::json json;
  try {
    json = nlohmann::json::parse(io::load_file(path, kMostBytes), nullptr, true, true);
  } catch (const nlohmann::json::exception& e) {
    throw IoError(path, "this is not JSON: " + std::string(e.what()));
  }
  const JsonPlace root(json, "", path);
  root.require_object();
  root.allow_keys({"strokes"});
  const JsonPlace list = root.at("strokes");
  list.require_array(1);
  std::vector<Stroke> strokes;
  for (std::size_t i = 0; i < list.size(); ++i) strokes.push_back(read_stroke(list.at(i)));
  return strokes;
}

}  // namespace meniscus::scene
