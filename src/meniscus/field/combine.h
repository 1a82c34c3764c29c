#pragma once

#include <meniscus/field/field.h>

#include <memory>
#include <vector>

namespace meniscus::field {

using Inputs = std::vector<std::unique_ptr<Field>>;

// Set operations on the insides. Inputs' unknowns are named "inputs[i].…"; shared names stay one unknown.
// All throw InvalidInput without inputs. Where two inputs are equal the first one's derivatives count.

/// min of all inputs.
std::unique_ptr<Field> set_union(Inputs inputs);
/// max of all inputs.
std::unique_ptr<Field> set_intersection(Inputs inputs);
/// The first input less all others: max(F₀, −F₁, −F₂, …).
std::unique_ptr<Field> set_difference(Inputs inputs);
/// Union with a smooth joint of width k > 0 (units of F, world units for distances): min(a, b) − k h³/6 with
/// h = max(0, 1 − |a−b|/k), twice differentiable, taken over the inputs in their order.
std::unique_ptr<Field> blend(Inputs inputs, const Number& k);

/// F − distance: grown outwards for a positive distance.
std::unique_ptr<Field> offset(std::unique_ptr<Field> input, const Number& distance);
/// |F| − thickness/2: a wall of that thickness (for distances) about the surface.
std::unique_ptr<Field> shell(std::unique_ptr<Field> input, const Number& thickness);

}  // namespace meniscus::field
