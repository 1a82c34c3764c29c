#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/io/geometry.h>
#include <meniscus/points/cloud.h>
#include <meniscus/pointset/boolean.h>
#include <meniscus/pointset/local_fit.h>
#include <meniscus/pointset/normals.h>

#include <string>

namespace meniscus::scene {

/// What happened on the way from points to a surface.
struct PointSurfaceReport {
  pointset::FitReport fit;
  pointset::NormalReport normals;
  bool estimated = false;  ///< `normals` says something: some or all had to be estimated
};

/// Whether points without faces are meant as a surface where a surface is asked for: they have normals ("N") and no radius
/// of their own. All other points are particles.
bool is_point_surface(const points::Cloud& cloud);

/// The points of a file's content: a mesh's vertices with its normals, or those of its faces about them.
points::Cloud points_of(io::Geometry geometry);

/// The point-set surface of a cloud; normals that are missing or zero are estimated. Throws IoError with `path` for points
/// of which no surface can be made.
pointset::Solid point_surface(points::Cloud cloud, const std::string& path, const pointset::FitOptions& options = {},
                              PointSurfaceReport* report = nullptr, const RunControl& run = {});

/// The same for a file: an `.msurf` as it is, the points of any other fitted.
pointset::Solid read_point_surface(const std::string& path, const pointset::FitOptions& options = {},
                                   PointSurfaceReport* report = nullptr, const RunControl& run = {});

}  // namespace meniscus::scene
