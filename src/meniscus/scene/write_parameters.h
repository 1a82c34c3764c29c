#pragma once

#include <meniscus/field/parameter.h>
#include <meniscus/scene/document.h>

#include <string>
#include <vector>

namespace meniscus::scene {

/// A number of a scene and what it became.
struct ParameterChange {
  std::string name;  ///< as in Field::parameters(): a path below "surface", or an entry of "params"
  bool shared = false;
  double before = 0;
  double after = 0;
};

/// The values that the document gives the unknowns. Throws InvalidInput for a name without a place in it.
std::vector<double> parameter_values(const Document& document, const std::vector<field::Parameter>& parameters);

/// The unknowns whose values differ from those the document gives them.
std::vector<ParameterChange> parameter_changes(const Document& document, const std::vector<field::Parameter>& parameters);

/// Writes values into the places they were read from; everything else in the document stays. All or nothing: throws
/// InvalidInput for a name without a place in the document, or a value that is out of its range or not finite.
void write_parameters(Document& document, const std::vector<ParameterChange>& changes);

}  // namespace meniscus::scene
