#pragma once

#include <meniscus/field/field.h>
#include <meniscus/field/grid.h>
#include <meniscus/mesh/mesh.h>
#include <meniscus/scene/living_surface.h>
#include <meniscus/scene/track_state.h>

#include <cstdint>
#include <string>
#include <vector>

namespace meniscus::scene {

/// The mesh of a living surface whose vertices stay the same ones from frame to frame: carried by the surface's velocity,
/// put back onto the surface and evened out, and mended only where it no longer is the surface (polygonize/mend.h).
/// Closed and manifold in every frame. Attributes: "id" (never used twice), "rest" (where the vertex was in the first frame;
/// for new vertices interpolated from the nearest place of the old mesh), "N", "v".
class PersistentMesh {
 public:
  /// `fairing`: rounds a frame that even out the triangles in the tangent plane; vertices slide by little where the
  /// triangles are even already.
  explicit PersistentMesh(int fairing = 6) : fairing_(fairing) {}

  /// Follows `surface`, which has gone on by `duration` seconds since the last call (the first makes the mesh). Same bits
  /// for any number of threads. Costs about three times a fresh mesh, and twice that again where it is mended.
  MeshChange follow(const LivingSurface& surface, double duration, const RunControl& run = {});

  const mesh::Mesh& mesh() const { return mesh_; }
  /// What must be kept to go on after this frame, and going on from it.
  TrackState state() const { return {mesh_, {}, next_id_, 0}; }
  void resume(TrackState state);

 private:
  struct Shape;
  void start(const Shape& shape, const RunControl& run);
  std::vector<std::uint8_t> carry(const LivingSurface& surface, const Shape& shape, double duration, const RunControl& run);
  std::string fault(const Shape& shape, std::vector<std::uint8_t>& bad, const RunControl& run) const;
  void mend(const Shape& shape, const std::vector<std::uint8_t>& bad, MeshChange& change, const RunControl& run);

  int fairing_;
  mesh::Mesh mesh_;
  std::int64_t next_id_ = 0;
  bool started_ = false;
};

}  // namespace meniscus::scene
