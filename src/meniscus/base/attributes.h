#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace meniscus {

/// Canonical attribute names; files use their own words for them.
namespace attribute {
inline constexpr std::string_view kNormal = "N";       ///< unit outward normal, n×3
inline constexpr std::string_view kVelocity = "v";     ///< world units per second, n×3
inline constexpr std::string_view kColor = "Cd";       ///< linear RGB in [0, 1], n×3
inline constexpr std::string_view kRadius = "pscale";  ///< world units, n×1
inline constexpr std::string_view kId = "id";          ///< integer identity, n×1
}  // namespace attribute

/// One named array: `components` numbers per element, element-major (element i owns [i*components, (i+1)*components)).
struct Attribute {
  std::string name;
  std::size_t components = 1;
  std::variant<std::vector<double>, std::vector<std::int64_t>> data;

  bool is_integer() const { return data.index() == 1; }
  /// Number of elements.
  std::size_t size() const;
};

/// The named arrays that ride on the points of a cloud or the vertices of a mesh, in order of insertion.
/// All have the same number of elements as their owner; the owner's audit checks it.
class Attributes {
 public:
  /// Adds or replaces an array. Throws InvalidInput if the number of values is no multiple of `components`.
  std::vector<double>& set(std::string_view name, std::size_t components, std::vector<double> values);
  std::vector<std::int64_t>& set_integers(std::string_view name, std::size_t components, std::vector<std::int64_t> values);

  const Attribute* find(std::string_view name) const;
  bool has(std::string_view name) const { return find(name) != nullptr; }
  /// Values of a floating-point attribute with that many components; empty when there is none.
  std::span<const double> values(std::string_view name, std::size_t components) const;
  std::span<double> values(std::string_view name, std::size_t components);
  /// Values of an integer attribute; empty when there is none.
  std::span<const std::int64_t> integers(std::string_view name, std::size_t components = 1) const;

  void erase(std::string_view name);
  bool empty() const { return list_.empty(); }
  auto begin() const { return list_.begin(); }
  auto end() const { return list_.end(); }

  /// The same attributes for the elements `indices`, in that order.
  Attributes gathered(std::span<const std::size_t> indices) const;

 private:
  Attribute& slot(std::string_view name);
  std::vector<Attribute> list_;
};

}  // namespace meniscus
