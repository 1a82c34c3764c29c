#pragma once

#include <meniscus/base/function_ref.h>
#include <meniscus/render/scene.h>

namespace meniscus::render {

/// The radius of every point of the cloud after the item's options; a value may be useless (NaN, not positive).
std::vector<double> radii_of(const CloudItem& item);

/// Calls visit(center, radius) for every vertex (radius 0) and every point of the subject, strays excluded.
void visit_subject(const Scene& scene, FunctionRef<void(const Vec3&, double)> visit);

}  // namespace meniscus::render
