#pragma once

#include <meniscus/field/field.h>

#include <memory>
#include <string>
#include <vector>

namespace meniscus::field {

/// The inputs of a composite field and how their unknowns merge into the composite's: literals are prefixed with the input's
/// place, equal shared names become one. Copies are deep.
class Children {
 public:
  /// Appends the inputs' unknowns to `parameters`. `place` is "inputs" for several, "input" for one.
  Children(std::vector<std::unique_ptr<Field>> inputs, const std::string& place, std::vector<Parameter>& parameters);
  Children(const Children& other);
  Children& operator=(const Children&) = delete;

  std::size_t size() const { return fields_.size(); }
  const Field& operator[](std::size_t i) const { return *fields_[i]; }
  void set_parameters(std::span<const double> values, std::span<const double> rates);
  void set_time(double t);
  bool moving() const;

  /// Appends child i's row `r` of `rows`, times `factor`, to the row of `out` under construction.
  void append_row(std::size_t i, const SparseRows& rows, std::size_t r, double factor, SparseRows& out) const;

 private:
  std::vector<std::unique_ptr<Field>> fields_;
  std::vector<std::vector<std::uint32_t>> maps_;
};

/// Adds the unknowns of a composite's own slots to `parameters`; returns where each went.
std::vector<std::uint32_t> merge_parameters(const std::vector<Parameter>& own, const std::string& prefix,
                                            std::vector<Parameter>& parameters);
/// The entries of `values` at `map`; all zero if `values` is empty.
std::vector<double> gather(std::span<const double> values, const std::vector<std::uint32_t>& map);

}  // namespace meniscus::field
