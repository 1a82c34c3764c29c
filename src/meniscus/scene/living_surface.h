#pragma once

#include <meniscus/band/band.h>
#include <meniscus/io/geometry.h>
#include <meniscus/mesh/mesh.h>

#include <nlohmann/json.hpp>

#include <functional>
#include <optional>
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

/// Where frames go.
struct SequenceOutput {
  std::string meshes;                ///< mesh per frame: "skin.####.ply" (obj, vtp, usda, stl as well)
  std::optional<std::string> grids;  ///< level set per frame: "skin.####.vdb"
  bool velocity_grids = false;       ///< with it a grid "velocity" of the same active voxels, units per second
  double fps = 24;                   ///< frames per second of the sequence
  bool persistent = false;           ///< carry the mesh from frame to frame, see PersistentMesh
  bool resume = false;               ///< go on after the last frame that an earlier run of the same settings finished
  io::WriteOptions write;
};

/// What became of a mesh that is carried from frame to frame.
struct MeshChange {
  /// Why something was meshed anew: "first", "topology" (number of components or handles changed), "lost" (vertices lost
  /// their sheet), "folded" (triangles turned over) or "stretched" (triangles too long, too thin or off the surface). Empty
  /// when every vertex was carried.
  std::string reason;
  std::vector<Box> regions;  ///< where
  std::size_t carried = 0;   ///< vertices that were carried, with their ids
};

/// As reports and manifests tell it: {remeshed, regions: [[low, high]], carried}.
nlohmann::json to_json(const MeshChange& change);

/// What was written of one frame.
struct FrameRecord {
  long frame = 0;
  std::string path;
  std::size_t vertices = 0, triangles = 0;
  Box bounds = {};
  double seconds = 0;
  std::optional<MeshChange> change = {};  ///< of a persistent mesh
  bool kept = false;                      ///< finished by an earlier run: nothing else is known
};

/// Lives through `frames` and writes each, whole or not at all, with a manifest and, for ParaView and USD formats, the
/// collection that ties them. The manifest tells where and why a persistent mesh was meshed anew. `settings`: text that
/// determines the frames; a run that was killed and resumed with the same leaves the same bytes as one that was not.
/// `on_frame` hears of every frame once it is on disk. Throws InvalidInput for an output without a place for the frame
/// number, IoError, ResourceLimit, Cancelled.
void write_sequence(LivingSurface& surface, const std::vector<long>& frames, const SequenceOutput& output,
                    const std::string& settings, const std::function<void(const FrameRecord&)>& on_frame = {},
                    RunControl run = {});

}  // namespace meniscus::scene
