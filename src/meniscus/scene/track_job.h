#pragma once

#include <meniscus/io/geometry.h>
#include <meniscus/motion/tracker.h>
#include <meniscus/scene/surface_source.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace meniscus::scene {

/// A moving surface in; a mesh or points that are carried along it, with velocities, out.
struct TrackJobOptions {
  motion::TrackerOptions tracker;
  bool points = false;                 ///< points without faces instead of a mesh
  std::optional<double> voxel;         ///< cell size of the first mesh, world units; the source's own when not given
  int first_fairing = 10;              ///< rounds that even out new triangles
  int redistribution = 12;             ///< frames between redistributions of points; 0 = never
  std::optional<double> checker = {};  ///< paints the first mesh (Cd) with squares of this size, to see colours carried
  std::string output;                  ///< "track.####.ply" (obj, vtp, usda as well); a plain name for a single frame
  bool resume = false;                 ///< go on after the last frame that an earlier run of the same settings finished
  io::WriteOptions write;
};

/// What was made of one frame.
struct TrackJobFrame {
  long frame = 0;
  std::string path;
  std::size_t vertices = 0, triangles = 0;
  Box bounds;
  motion::StepReport step;  ///< of the step that led here; for the first frame and new meshes, of the mesh as it is
  /// Why something was meshed anew: "first", "topology" (number of components or handles changed), "lost" (vertices lost
  /// their sheet), "folded" (more than a hundredth of the triangles turned over) or "stretched" (a triangle's middle is
  /// half a voxel off the surface); of points "redistributed". Empty when everything was carried.
  std::string remeshed;
  std::vector<Box> regions;      ///< where
  std::size_t kept = 0;          ///< vertices or points that were carried, with their ids
  std::size_t born = 0;          ///< points placed where coverage opened up, or by redistribution
  double seconds = 0;            ///< all of the frame, writing included
  bool finished_before = false;  ///< by an earlier run: nothing else is known
};

/// Carries a mesh (or points) over the frames of `source` and writes each frame, whole or not at all, with a manifest and,
/// for ParaView and USD formats, the collection that ties them; a run that was killed and resumed leaves the same bytes.
/// With attributes N, v (of the vertex as written), id and rest (position in the first frame). When the topology changes,
/// seen from the signs of F on a lattice of `voxel`, or vertices are lost, or the mesh folds, it is mended where it no
/// longer is the surface (polygonize/mend.h): new vertices have new ids and take other attributes from the nearest place of
/// the old mesh. Throws InvalidInput for settings without meaning or a source without frames, IoError, ResourceLimit,
/// Cancelled.
std::vector<TrackJobFrame> run_track_job(const SurfaceSource& source, const TrackJobOptions& options,
                                         const std::function<void(const TrackJobFrame&)>& on_frame = {},
                                         RunControl run = {});

}  // namespace meniscus::scene
