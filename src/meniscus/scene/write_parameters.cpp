#include <meniscus/base/error.h>
#include <meniscus/scene/write_parameters.h>

#include <algorithm>

#include <cmath>

namespace meniscus::scene {
namespace {

using nlohmann::json;

[[noreturn]] void no_place(const Document& document, const std::string& name) {
  throw InvalidInput(document.path() + " has no number at '" + name + "'");
}

/// The JSON pointer of a path such as "inputs[0].center.x", whose last word may be a component of a vector.
json::json_pointer pointer_of(const Document& document, const std::string& name) {
  json::json_pointer at("/surface");
  const json* value = &document.json().at("surface");
  for (std::size_t begin = 0; begin < name.size();) {
    if (name[begin] == '.' || name[begin] == '[' || name[begin] == ']') {
      ++begin;
      continue;
    }
    const std::size_t end = std::min(name.find_first_of(".[]", begin), name.size());
    std::string word = name.substr(begin, end - begin);
    begin = end;
    if (value->is_array()) {
      if (word.size() == 1 && word[0] >= 'x' && word[0] <= 'z') word = std::to_string(word[0] - 'x');
      if (word.find_first_not_of("0123456789") != std::string::npos || std::stoul(word) >= value->size())
        no_place(document, name);
      value = &(*value)[std::stoul(word)];
    } else {
      // Blobs call their constant "bias" or "threshold": one unknown.
      if (value->is_object() && word == "bias" && !value->contains(word)) word = "threshold";
      if (!value->is_object() || !value->contains(word)) no_place(document, name);
      value = &(*value)[word];
    }
    at /= word;
  }
  if (!value->is_number()) no_place(document, name);
  return at;
}

double value_in(const Document& document, const std::string& name, bool shared) {
  if (!shared) return document.json().at(pointer_of(document, name)).get<double>();
  const json& params = document.json().value("params", json::object());
  if (!params.contains(name)) no_place(document, name);
  return params.at(name).at("value").get<double>();
}

}  // namespace

std::vector<double> parameter_values(const Document& document, const std::vector<field::Parameter>& parameters) {
  std::vector<double> values;
  for (const field::Parameter& p : parameters) values.push_back(value_in(document, p.name, p.shared));
  return values;
}

std::vector<ParameterChange> parameter_changes(const Document& document, const std::vector<field::Parameter>& parameters) {
  const std::vector<double> before = parameter_values(document, parameters);
  std::vector<ParameterChange> changes;
  for (std::size_t k = 0; k < before.size(); ++k)
    if (const field::Parameter& p = parameters[k]; before[k] != p.value)
      changes.push_back({p.name, p.shared, before[k], p.value});
  return changes;
}

void write_parameters(Document& document, const std::vector<ParameterChange>& changes) {
  Document next = document;
  for (const ParameterChange& c : changes) {
    if (!std::isfinite(c.after)) throw InvalidInput("the value of '" + c.name + "' is not finite");
    if (c.shared)
      next.set_parameter(c.name, c.after);
    else
      next.set_number(pointer_of(document, c.name), c.after);
  }
  document = std::move(next);
}

}  // namespace meniscus::scene
