#pragma once

#include <meniscus/band/band.h>
#include <meniscus/io/geometry.h>
#include <meniscus/motion/tracker.h>
#include <meniscus/scene/frame_sequence.h>
#include <meniscus/scene/surface_source.h>
#include <meniscus/scene/track_state.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace meniscus::polygonize {
struct PolygonizeOptions;
}

namespace meniscus::scene {

struct TrackOptions {
  motion::TrackerOptions tracker = {};
  bool points = false;                     ///< points without faces instead of a mesh
  std::optional<double> voxel;             ///< cell size of new meshes, world units; the source's own when not given
  int first_fairing = 10;                  ///< rounds that even out new triangles
  int redistribution = 12;                 ///< frames between redistributions of points; 0 = never
  std::optional<double> checker = {};      ///< paints what is carried (Cd) with squares of this size, to see colours carried
  std::optional<io::Geometry> start = {};  ///< a mesh (or points) of the first surface to begin with, with its attributes
};

/// What a step did.
struct TrackStep {
  motion::StepReport step;  ///< of the step that led here; for the first frame and new meshes, of the mesh as it is
  MeshChange change;
  std::size_t born = 0;  ///< points placed where coverage opened up, or by redistribution
};

/// A mesh or points carried over the frames of a moving surface. The mesh is mended where it no longer is the surface
/// (polygonize/mend.h): when its topology is not that of F's signs on a lattice of the voxel size, vertices are lost, more
/// than a hundredth of its triangles turned over, or a triangle's middle is half a voxel off. New vertices have new ids and
/// take other attributes from the nearest place of the old mesh. Points are born where coverage opens up, and repel each
/// other now and then. Same bits for any number of threads.
class TrackedSurface {
 public:
  /// `source` must live as long as this. Throws InvalidInput for options without meaning.
  TrackedSurface(const SurfaceSource& source, TrackOptions options);

  /// Goes on to a frame; the first call begins there. Throws InvalidInput for an unbounded surface, or a start that is not
  /// closed or not the surface (more than half of it farther off than two voxels).
  TrackStep go_to(long frame, const RunControl& run = {});

  bool points() const { return options_.points; }
  const mesh::Mesh& mesh() const { return mesh_->mesh(); }         ///< unless points()
  const points::Cloud& cloud() const { return points_->cloud(); }  ///< if points()
  /// The level set of the moment, at the size of the voxels.
  band::Band band(const RunControl& run = {}) const;
  /// Velocities at places near the surface: those of the nearest place of the mesh (the nearest point).
  std::vector<Vec3> velocities(std::span<const Vec3> at) const;

  /// What must be kept to go on after this frame, and going on from it.
  TrackState state() const;
  void resume(long frame, TrackState state, const RunControl& run = {});

 private:
  double time_of(long frame) const { return static_cast<double>(frame) / source_.frames_per_second(); }
  void open(long frame, const RunControl& run);
  polygonize::PolygonizeOptions meshing() const;
  mesh::Mesh lattice_surface(const RunControl& run) const;
  mesh::Mesh new_mesh(const RunControl& run) const;
  motion::TrackerOptions tracking() const;
  Attributes first_attributes(const std::vector<Vec3>& positions) const;
  void identify(Attributes& attributes, const std::vector<Vec3>& positions);

  TrackStep start(long frame, const RunControl& run);
  mesh::Mesh given_mesh(const RunControl& run);
  points::Cloud given_points(const RunControl& run);
  template <class Tracker>
  motion::StepReport carry(Tracker& tracker, long frame, const RunControl& run);
  TrackStep advance_mesh(long frame, const RunControl& run);
  TrackStep advance_points(long frame, const RunControl& run);
  std::string fault(const motion::StepReport& step, const RunControl& run) const;
  bool stretched(const RunControl& run) const;
  void mend(std::span<const std::uint8_t> lost, TrackStep& out, const RunControl& run);

  const SurfaceSource& source_;
  TrackOptions options_;
  Surface surface_;
  double voxel_ = 0;
  std::int64_t next_id_ = 0;
  std::int64_t steps_ = -1;  // after the first frame
  std::optional<motion::MeshTracker> mesh_;
  std::optional<motion::PointTracker> points_;
};

}  // namespace meniscus::scene
