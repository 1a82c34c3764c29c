#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/field/field.h>
#include <meniscus/scene/document.h>

#include <memory>

namespace meniscus::scene {

/// The field that a scene's "surface" describes, posed at time 0. Files it names (meshes, grids, particles) are read.
/// Every literal number of a leaf is an unknown named by its path in the JSON below "surface" ("inputs[0].items[2].radius";
/// the components of a vector "center.x" …), unless its leaf freezes it; {"param": name} is a shared unknown.
/// Throws IoError naming the place for unknown types, keys, parameters, wrong values and unreadable files.
std::unique_ptr<field::Field> build_field(const Document& document, const RunControl& run = {});

}  // namespace meniscus::scene
