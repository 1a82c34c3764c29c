#pragma once

#include <meniscus/band/band.h>
#include <meniscus/mesh/mesh.h>
#include <meniscus/scene/frame_sequence.h>

#include <nlohmann/json.hpp>

#include <functional>
#include <string>
#include <vector>

namespace meniscus::scene {

/// A surface in a narrow band that lives from frame to frame: a skin, a metamorphosis.
class LivingSurface {
 public:
  virtual ~LivingSurface() = default;
  /// Goes on to frame number `index`, counted from 0; called for each in turn.
  virtual void advance(std::size_t index, const RunControl& run) = 0;
  virtual const band::Band& band() const = 0;
  virtual std::vector<Vec3> velocities(std::span<const Vec3> at, const RunControl& run) const = 0;
  /// Gives the vertices of a mesh of the surface v (units per second) and whatever else they have.
  virtual void dress(mesh::Mesh& mesh, const RunControl& run) const;
  /// What must be kept beside the band to go on after this frame.
  virtual nlohmann::json state() = 0;
  /// Goes on from frame number `index`, saved earlier. Throws InvalidInput for a state without meaning.
  virtual void resume(std::size_t index, band::Band band, const nlohmann::json& state, const RunControl& run) = 0;
};

/// The mesh of a band, made anew: closed, with N.
mesh::Mesh mesh_of(const band::Band& band, const RunControl& run = {});

/// Lives through `frames` and writes each: see make_frames().
void write_sequence(LivingSurface& surface, const std::vector<long>& frames, const SequenceOutput& output,
                    const std::string& settings, const std::function<void(const FrameRecord&)>& on_frame = {},
                    RunControl run = {});

}  // namespace meniscus::scene
