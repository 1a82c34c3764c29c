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
  bool points = false;          ///< points without faces instead of a mesh
  std::optional<double> voxel;  ///< cell size of the first mesh, world units; the source's own when not given
  int first_fairing = 10;       ///< rounds that even out a new mesh
  std::string output;           ///< "track.####.ply" (obj, vtp, usda as well); a plain name for a single frame
  io::WriteOptions write;
};

/// What was made of one frame.
struct TrackJobFrame {
  long frame = 0;
  std::string path;
  std::size_t vertices = 0, triangles = 0;
  Box bounds;
  motion::StepReport step;  ///< of the step that led here; for the first frame and new meshes, of the mesh as it is
  /// Why the frame was meshed anew: "first", "topology" (number of components or handles changed) or "lost" (vertices lost
  /// their sheet) or "folded" (more than a hundredth of the triangles turned over). Empty when it was carried.
  std::string remeshed;
  double seconds = 0;  ///< all of the frame, writing included
};

/// Carries a mesh (or its vertices) over the frames of `source` and writes each frame, with attributes N, v (of the vertex
/// as written), id and rest (position in the first frame). Where the topology changes, seen from the signs of F on a lattice
/// of `voxel`, or vertices are lost, the whole surface is meshed anew: rest comes from the nearest old vertex, ids are new
/// ones. Throws InvalidInput for settings without meaning or a source without frames, IoError, ResourceLimit, Cancelled.
std::vector<TrackJobFrame> run_track_job(const SurfaceSource& source, const TrackJobOptions& options,
                                         const std::function<void(const TrackJobFrame&)>& on_frame = {},
                                         RunControl run = {});

}  // namespace meniscus::scene
