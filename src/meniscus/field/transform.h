#pragma once

#include <meniscus/field/field.h>

#include <memory>

namespace meniscus::field {

/// Moves a field: turned by `rotate` (degrees about x, then y, then z), scaled by `scale` > 0, then shifted by `translate`
/// (world units). F is multiplied by the scale, so distances stay distances. Its material moves with it, rigidly.
/// Unknowns: "translate.x" … "rotate.z", "scale", and the input's. Throws InvalidInput for a scale that is not above zero.
std::unique_ptr<Field> transform(std::unique_ptr<Field> input, const Number3& translate, const Number3& rotate,
                                 const Number& scale);

}  // namespace meniscus::field
