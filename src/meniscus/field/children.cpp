#include <meniscus/base/error.h>
#include <meniscus/field/children.h>

#include <algorithm>
#include <unordered_map>

namespace meniscus::field {

std::vector<std::uint32_t> merge_parameters(const std::vector<Parameter>& own, const std::string& prefix,
                                            std::vector<Parameter>& parameters) {
  std::unordered_map<std::string, std::uint32_t> shared;
  for (std::uint32_t i = 0; i < parameters.size(); ++i)
    if (parameters[i].shared) shared.emplace(parameters[i].name, i);
  std::vector<std::uint32_t> map;
  map.reserve(own.size());
  for (const Parameter& p : own) {
    const auto next = static_cast<std::uint32_t>(parameters.size());
    if (p.shared) {
      const auto [it, fresh] = shared.emplace(p.name, next);
      map.push_back(it->second);
      if (!fresh) {
        // Every place that reads a shared unknown may bound it.
        Parameter& known = parameters[it->second];
        if (known.value != p.value) throw InvalidInput("parameter '" + p.name + "' is given two values");
        known.min = std::max(known.min, p.min);
        known.max = std::min(known.max, p.max);
        continue;
      }
    } else {
      map.push_back(next);
    }
    parameters.push_back(p);
    if (!p.shared) parameters.back().name = prefix + p.name;
  }
  return map;
}

std::vector<double> gather(std::span<const double> values, const std::vector<std::uint32_t>& map) {
  std::vector<double> out;
  out.reserve(map.size());
  for (const std::uint32_t i : map) out.push_back(values.empty() ? 0 : values[i]);
  return out;
}

Children::Children(std::vector<std::unique_ptr<Field>> inputs, const std::string& place, std::vector<Parameter>& parameters)
    : fields_(std::move(inputs)) {
  if (fields_.empty()) throw InvalidInput("a composite field needs an input");
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    if (!fields_[i]) throw InvalidInput("a composite field's input is missing");
    const std::string prefix = fields_.size() == 1 && place == "input" ? "input." : place + "[" + std::to_string(i) + "].";
    maps_.push_back(merge_parameters(fields_[i]->parameters(), prefix, parameters));
  }
}

Children::Children(const Children& other) : maps_(other.maps_) {
  for (const auto& f : other.fields_) fields_.push_back(f->clone());
}

void Children::set_parameters(std::span<const double> values, std::span<const double> rates) {
  for (std::size_t i = 0; i < fields_.size(); ++i)
    fields_[i]->set_parameters(gather(values, maps_[i]), gather(rates, maps_[i]));
}

void Children::set_time(double t) {
  for (const auto& f : fields_) f->set_time(t);
}

bool Children::moving() const {
  return std::any_of(fields_.begin(), fields_.end(), [](const auto& f) { return f->moving(); });
}

void Children::append_row(std::size_t i, const SparseRows& rows, std::size_t r, double factor, SparseRows& out) const {
  if (factor == 0) return;
  for (std::size_t k = rows.begin[r]; k < rows.begin[r + 1]; ++k) {
    out.index.push_back(maps_[i][rows.index[k]]);
    out.value.push_back(factor * rows.value[k]);
  }
}

}  // namespace meniscus::field
