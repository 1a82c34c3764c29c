#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/polygonize/clipped_field.h>
#include <meniscus/polygonize/project.h>
#include <meniscus/polygonize/shell.h>

namespace meniscus::polygonize {

/// Moves the vertices of cells that a crease of the surface passes through onto the crease: the intersection of the smooth
/// branches of the surface that meet there (two at an edge, three or more at a corner).
///
/// Takes vertices that project() has placed, with normals. Candidates are the vertices next to which the normal turns
/// sharply. For these the crossings of the loop with the lattice's edges are found on the true field; each stands for the
/// branch it lies on. The vertex minimises the squared distances to the branches' tangent planes (the quadratic error
/// function of dual contouring), which are then taken anew ever nearer to it: Newton's method on all branches at once, each
/// evaluated where it is the active one. A vertex is moved only if this converges within 4 voxels of its cell
/// (beside an acute edge loops that see both sides stand far from it, and one left behind is a notch), if F vanishes there
/// to the tolerance, and if the normals still disagree 1e-5 voxel from it: a smooth surface, however curved, stays as it is.
/// Normals on creases are set to zero, which finish() takes for missing. Updates `report`. Cost: linear, nothing noticeable
/// where there are no creases.
void place_on_creases(const ClippedField& field, Shell& shell, double tolerance, ProjectReport& report,
                      const RunControl& run);

}  // namespace meniscus::polygonize
