#include <meniscus/base/suggest.h>
#include <meniscus/field/curve.h>
#include <meniscus/field/time_expression.h>
#include <meniscus/scene/number.h>

#include <algorithm>
#include <limits>
#include <map>

namespace meniscus::scene {
namespace {

constexpr const char* kAxes[3] = {".x", ".y", ".z"};

std::shared_ptr<const field::TimeFunction> curve(const JsonPlace& place) {
  place.allow_keys({"t", "v", "interp"});
  const JsonPlace t = place.at("t"), v = place.at("v");
  t.require_array(1);
  v.require_array(1);
  if (t.size() != v.size()) place.fail("'t' and 'v' must have the same length");
  std::vector<double> times, values;
  for (std::size_t i = 0; i < t.size(); ++i) {
    times.push_back(t.at(i).number());
    values.push_back(v.at(i).number());
  }
  const std::string interp = place.has("interp") ? place.at("interp").text() : "linear";
  static const std::map<std::string, field::CurveInterpolation, std::less<>> kKinds{
      {"step", field::CurveInterpolation::Step},
      {"linear", field::CurveInterpolation::Linear},
      {"cubic", field::CurveInterpolation::Cubic}};
  const auto kind = kKinds.find(interp);
  if (kind == kKinds.end()) {
    const std::string_view words[] = {"step", "linear", "cubic"};
    place.at("interp").fail("'" + interp + "' is none of step, linear, cubic" + did_you_mean(interp, words));
  }
  try {
    return std::make_shared<field::Curve>(std::move(times), std::move(values), kind->second);
  } catch (const InvalidInput& e) {
    place.fail(e.what());
  }
}

}  // namespace

NumberReader::NumberReader(const nlohmann::json* params, const JsonPlace& node) : params_(params) {
  if (!node.has("freeze")) return;
  const JsonPlace list = node.at("freeze");
  list.require_array();
  for (std::size_t i = 0; i < list.size(); ++i) frozen_.push_back(list.at(i).text());
}

bool NumberReader::is_frozen(const std::string& path) const {
  return std::any_of(frozen_.begin(), frozen_.end(), [&](const std::string& f) {
    return path.starts_with(f) && (path.size() == f.size() || path[f.size()] == '.' || path[f.size()] == '[');
  });
}

field::Number NumberReader::named(const JsonPlace& place) const {
  place.allow_keys({"param"});
  const std::string name = place.at("param").text();
  if (params_ == nullptr || !params_->contains(name)) {
    std::vector<std::string_view> names;
    if (params_ != nullptr)
      for (const auto& [key, value] : params_->items()) names.push_back(key);
    place.fail("the scene has no parameter '" + name + "'" + did_you_mean(name, names));
  }
  const nlohmann::json& p = (*params_)[name];
  const double infinity = std::numeric_limits<double>::infinity();
  return field::Number::named(name, p["value"].get<double>(), p.value("min", -infinity), p.value("max", infinity));
}

field::Number NumberReader::number(const JsonPlace& place, const std::string& path) const {
  if (place.json().is_number())
    return is_frozen(path) ? field::Number::frozen(place.number()) : field::Number(place.number());
  if (!place.json().is_object())
    place.fail("a number is expected: a literal, {\"param\": name}, {\"t\": […], \"v\": […]} or {\"expr\": \"…\"}");
  if (place.has("param")) return named(place);
  if ((place.has("t") || place.has("v")) && !place.has("expr")) return field::Number::animated(curve(place));
  place.allow_keys({"expr"});
  const JsonPlace text = place.at("expr");
  try {
    return field::Number::animated(std::make_shared<field::TimeExpression>(text.text()));
  } catch (const InvalidInput& e) {
    text.fail(e.what());
  }
}

field::Number3 NumberReader::vector(const JsonPlace& place, const std::string& path) const {
  if (!place.json().is_array() || place.size() != 3) place.fail("three numbers are expected: [x, y, z]");
  return {number(place.at(std::size_t{0}), path + kAxes[0]), number(place.at(std::size_t{1}), path + kAxes[1]),
          number(place.at(std::size_t{2}), path + kAxes[2])};
}

field::Number NumberReader::member(const JsonPlace& parent, std::string_view key, const std::string& prefix) const {
  return number(parent.at(key), prefix + std::string(key));
}

field::Number NumberReader::member(const JsonPlace& parent, std::string_view key, const std::string& prefix,
                                   double otherwise) const {
  return parent.has(key) ? member(parent, key, prefix) : field::Number::frozen(otherwise);
}

field::Number3 NumberReader::vector_member(const JsonPlace& parent, std::string_view key, const std::string& prefix) const {
  return vector(parent.at(key), prefix + std::string(key));
}

field::Number3 NumberReader::vector_member(const JsonPlace& parent, std::string_view key, const std::string& prefix,
                                           const Vec3& otherwise) const {
  if (parent.has(key)) return vector_member(parent, key, prefix);
  return {field::Number::frozen(otherwise.x()), field::Number::frozen(otherwise.y()), field::Number::frozen(otherwise.z())};
}

}  // namespace meniscus::scene
