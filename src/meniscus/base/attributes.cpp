#include <meniscus/base/attributes.h>
#include <meniscus/base/error.h>

#include <algorithm>
#include <utility>

namespace meniscus {
namespace {

template <class T>
std::vector<T> gather(const std::vector<T>& from, std::size_t components, std::span<const std::size_t> indices) {
  std::vector<T> to;
  to.reserve(indices.size() * components);
  for (const std::size_t i : indices)
    to.insert(to.end(), from.begin() + static_cast<std::ptrdiff_t>(i * components),
              from.begin() + static_cast<std::ptrdiff_t>((i + 1) * components));
  return to;
}

void check_shape(std::string_view name, std::size_t components, std::size_t count) {
  if (components == 0 || count % components != 0)
    throw InvalidInput("attribute '" + std::string(name) + "': " + std::to_string(count) +
                       " values do not fill elements of " + std::to_string(components));
}

}  // namespace

std::size_t Attribute::size() const {
  return std::visit([this](const auto& v) { return v.size() / components; }, data);
}

Attribute& Attributes::slot(std::string_view name) {
  const auto it = std::find_if(list_.begin(), list_.end(), [&](const Attribute& a) { return a.name == name; });
  if (it != list_.end()) return *it;
  list_.push_back({std::string(name), 1, {}});
  return list_.back();
}

std::vector<double>& Attributes::set(std::string_view name, std::size_t components, std::vector<double> values) {
  check_shape(name, components, values.size());
  Attribute& a = slot(name);
  a.components = components;
  return a.data.emplace<0>(std::move(values));
}

std::vector<std::int64_t>& Attributes::set_integers(std::string_view name, std::size_t components,
                                                    std::vector<std::int64_t> values) {
  check_shape(name, components, values.size());
  Attribute& a = slot(name);
  a.components = components;
  return a.data.emplace<1>(std::move(values));
}

const Attribute* Attributes::find(std::string_view name) const {
  const auto it = std::find_if(list_.begin(), list_.end(), [&](const Attribute& a) { return a.name == name; });
  return it == list_.end() ? nullptr : &*it;
}

std::span<const double> Attributes::values(std::string_view name, std::size_t components) const {
  const Attribute* a = find(name);
  if (a == nullptr || a->is_integer() || a->components != components) return {};
  return std::get<0>(a->data);
}

std::span<double> Attributes::values(std::string_view name, std::size_t components) {
  const auto view = std::as_const(*this).values(name, components);
  return {const_cast<double*>(view.data()), view.size()};
}

std::span<const std::int64_t> Attributes::integers(std::string_view name, std::size_t components) const {
  const Attribute* a = find(name);
  if (a == nullptr || !a->is_integer() || a->components != components) return {};
  return std::get<1>(a->data);
}

void Attributes::erase(std::string_view name) {
  std::erase_if(list_, [&](const Attribute& a) { return a.name == name; });
}

Attributes Attributes::gathered(std::span<const std::size_t> indices) const {
  Attributes out;
  for (const Attribute& a : list_) {
    if (a.is_integer())
      out.set_integers(a.name, a.components, gather(std::get<1>(a.data), a.components, indices));
    else
      out.set(a.name, a.components, gather(std::get<0>(a.data), a.components, indices));
  }
  return out;
}

}  // namespace meniscus
