#pragma once

#include <meniscus/mesh/mesh.h>
#include <meniscus/polygonize/shell.h>

#include <vector>

namespace meniscus::polygonize {

/// Mends the triangles along creases. Loops of several cells see the same piece of a crease, more the sharper it is, and
/// place_on_creases() puts them all onto it, in no particular order. Their triangles may lie along the crease without area,
/// be very thin, or face the wrong way beside it; here edges between crease vertices collapse and are flipped until none
/// does, as far as the mesh stays a closed manifold and no triangle beside them turns for the worse (by the normals of the
/// vertices that are on one sheet, which must be there). No vertex moves; corners stay; vertices that are merged are no
/// longer used. Deterministic, serial; cost: one look at every triangle, and linear in those at creases.
void tidy_creases(const Shell& shell, std::vector<Triangle>& triangles);

}  // namespace meniscus::polygonize
