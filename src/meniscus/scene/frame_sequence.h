#pragma once

#include <meniscus/base/box.h>
#include <meniscus/base/run_control.h>
#include <meniscus/io/geometry.h>

#include <nlohmann/json.hpp>

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace meniscus::scene {

/// Where frames go.
struct SequenceOutput {
  std::string meshes;                ///< mesh per frame: "skin.####.ply" (obj, vtp, usda, stl as well)
  std::optional<std::string> grids;  ///< level set per frame: "skin.####.vdb"
  bool velocity_grids = false;       ///< with it a grid "velocity" of the same active voxels, units per second
  double fps = 24;                   ///< frames per second of the sequence
  bool persistent = false;           ///< of a living surface: carry the mesh from frame to frame, see PersistentMesh
  bool resume = false;               ///< go on after the last frame that an earlier run of the same settings finished
  io::WriteOptions write;
};

/// What became of a mesh (or points) that is carried from frame to frame.
struct MeshChange {
  /// Why something was meshed anew: "first", "topology" (number of components or handles changed), "lost" (vertices lost
  /// their sheet), "folded" (triangles turned over) or "stretched" (triangles off the surface; of persistent meshes also too
  /// long or too thin); of points "redistributed". Empty when every vertex was carried.
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
  std::optional<std::string> grid_path = {};
  std::size_t vertices = 0, triangles = 0;
  Box bounds = {};
  double seconds = 0;                     ///< all of the frame, writing included
  std::optional<MeshChange> change = {};  ///< of a mesh that is carried
  bool kept = false;                      ///< finished by an earlier run: nothing else is known
};

/// What makes the frames of a sequence, one after the other, and can be put aside between two of them.
class FrameMaker {
 public:
  virtual ~FrameMaker() = default;
  /// Goes on to frame number `index`, counted from 0, writes what is asked for in `record` and fills in the rest.
  virtual void make(std::size_t index, FrameRecord& record, const io::WriteOptions& write, const RunControl& run) = 0;
  /// Endings of the files that hold what is needed to go on.
  virtual std::vector<std::string> state_endings() const = 0;
  /// Writes them: `stem` and an ending each.
  virtual void save(const std::string& stem, const io::WriteOptions& write) = 0;
  /// Goes on after frame number `index`, saved earlier. Throws IoError, or InvalidInput for a state without meaning.
  virtual void load(const std::string& stem, std::size_t index, const RunControl& run) = 0;
};

/// Makes `frames` and writes each, whole or not at all, with a manifest and, for ParaView and USD formats, the collection
/// that ties them. The manifest tells where and why a mesh was meshed anew. `settings`: text that determines the frames; a
/// run that was killed and resumed with the same leaves the same bytes as one that was not. `on_frame` hears of every frame
/// once it is on disk. A single frame may go to a plain name, without a manifest. Throws InvalidInput for an output of
/// several without a place for the frame number, IoError, ResourceLimit, Cancelled.
void make_frames(FrameMaker& maker, const std::vector<long>& frames, const SequenceOutput& output,
                 const std::string& settings, const std::function<void(const FrameRecord&)>& on_frame,
                 const RunControl& run);

}  // namespace meniscus::scene
