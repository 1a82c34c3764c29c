#include <meniscus/base/error.h>
#include <meniscus/mesh/components.h>
#include <meniscus/polygonize/bricks_near.h>
#include <meniscus/polygonize/clipped_field.h>
#include <meniscus/polygonize/crease.h>
#include <meniscus/polygonize/field_sampler.h>
#include <meniscus/polygonize/finish.h>
#include <meniscus/polygonize/jumps.h>
#include <meniscus/polygonize/polygonize.h>
#include <meniscus/polygonize/project.h>
#include <meniscus/polygonize/shell.h>

#include <cmath>
#include <sstream>

namespace meniscus::polygonize {
namespace {

std::string text(double value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

void check(const PolygonizeOptions& options) {
  if (!(options.voxel > 0) || !std::isfinite(options.voxel))
    throw InvalidInput("polygonize: voxel must be positive and finite, not " + text(options.voxel));
  if (options.projection < 0) throw InvalidInput("polygonize: projection must not be negative");
  if (options.box && !options.box->empty() && !options.box->finite())
    throw InvalidInput("polygonize: the box must be finite");
  if (options.box && (options.box->min.hasNaN() || options.box->max.hasNaN()))
    throw InvalidInput("polygonize: the box has a bound that is not a number");
}

/// The box to mesh in. The field's own bounds get room, so that the lattice's rim is outside.
Box domain(const field::Field& field, const PolygonizeOptions& options) {
  if (options.box) return *options.box;
  const Box bounds = field.bounds();
  if (bounds.empty()) return bounds;
  if (!bounds.finite()) throw InvalidInput("polygonize: the surface has no finite bounds; give a box to mesh in");
  return bounds.padded(options.voxel);
}

/// Whether the surface may cross the faces of the box.
bool leaves(const field::Field& field, const Box& box) {
  const Box bounds = field.bounds();
  return !bounds.empty() && !(box.contains(bounds.min) && box.contains(bounds.max));
}

Lattice lattice_over(const Box& box, double voxel) {
  constexpr double kMost = 2147483000;  // below 2³¹, with room for a brick's rim
  Lattice lattice;
  lattice.voxel = voxel;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto axis = static_cast<Eigen::Index>(a);
    const double low = std::floor(box.min[axis] / voxel);
    const double high = std::ceil(box.max[axis] / voxel);
    if (!(low > -kMost && high < kMost))
      throw ResourceLimit("polygonize: cells " + text(low) + " to " + text(high) + " along axis " + "xyz"[a] +
                          " are beyond the limit of 2147483000; use a larger voxel");
    lattice.low[a] = static_cast<std::int32_t>(low);
    lattice.high[a] = static_cast<std::int32_t>(high);
  }
  return lattice;
}

void warn(PolygonizeReport& report, const PolygonizeOptions& options) {
  if (report.vertices_at_box > 0)
    report.warnings.push_back("the surface leaves the box and is closed at its faces (" +
                              std::to_string(report.vertices_at_box) + " vertices lie on them)");
  if (options.projection > 0 && report.worst_residual > 1e-6)
    report.warnings.push_back("some vertices are off the surface by " + text(report.worst_residual) + " voxels");
}

}  // namespace

PolygonizeResult polygonize(const field::Field& field, const PolygonizeOptions& options, RunControl run) {
  check(options);
  PolygonizeResult result;
  PolygonizeReport& report = result.report;
  const Box box = domain(field, options);
  if (box.empty()) return result;

  const Lattice lattice = lattice_over(box, options.voxel);
  const ClippedField clipped(field, leaves(field, box) ? box : Box::everywhere());
  BricksNear near = bricks_near(clipped, lattice, options.max_cells, run);
  report.boxes_tested = near.boxes_tested;
  run.progress(0.2, "sampling");

  const FieldSampler sampler(clipped, lattice);
  Shell shell = build_shell(sampler, lattice, std::move(near.bricks), {false, options.max_cells}, run);
  report.evaluations = shell.evaluations;
  run.progress(0.6, "refining");

  const bool creases = options.creases && options.projection > 0;
  const ProjectOptions place{options.projection, 1e-9, options.normals || creases};
  ProjectReport projected = project(clipped, shell, place, run);
  if (creases) place_on_creases(clipped, shell, place.tolerance, projected, run);
  run.progress(0.9, "connecting");

  const auto settle = [&](Shell& s, std::span<const std::size_t> vertices) {
    if (options.projection > 0) settle_in_cells(clipped, s, vertices, projected);
  };
  result.mesh =
      finish(std::move(shell), {options.max_triangles, options.count_components, options.normals}, settle, report, run);
  if (options.open) {
    report.triangles_on_jumps = drop_jumps(clipped, options.voxel, result.mesh, run);
    if (options.count_components) report.components = mesh::components(result.mesh).count;
  }
  report.evaluations += projected.evaluations;
  report.vertices_bisected = projected.bisected;
  report.vertices_on_creases = projected.creases;
  report.vertices_at_box = projected.at_box;
  report.worst_residual = projected.worst_residual;
  warn(report, options);
  run.progress(1);
  return result;
}

}  // namespace meniscus::polygonize
