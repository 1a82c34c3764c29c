#pragma once

#include <meniscus/base/run_control.h>
#include <meniscus/field/field.h>
#include <meniscus/io/sequence.h>
#include <meniscus/scene/document.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace meniscus::scene {

/// How an input becomes a surface.
struct SourceOptions {
  std::optional<double> radius;  ///< of particles, world units; see default_radius
  std::optional<double> voxel;   ///< of the distance grid made of a mesh, world units; a 200th of its diameter
  std::vector<std::pair<std::string, double>> set;  ///< scene parameters to change before anything is built
  std::optional<std::vector<long>> frames;          ///< wanted frames of a moving scene or a sequence
  io::Missing missing = io::Missing::Error;
  std::optional<double> time;                          ///< seconds, for a scene without frames; 0 when not given
  std::optional<double> fps;                           ///< overrides the scene's; 24 for sequences
  std::function<void(const io::ReadReport&)> on_read;  ///< is told of every file of points or faces that was read
};

/// A field and a cell size that suits it.
struct Surface {
  std::unique_ptr<field::Field> field;
  double voxel = 0;         ///< world units; 0 when the field has no finite extent to tell it from
  points::Cloud particles;  ///< what the field was made of, if it was made of particles
  bool open = false;        ///< may have open borders: see PolygonizeOptions::open
};

/// Any input of which a surface can be made: a scene, a mesh, a level set, a point-set surface (an .msurf, or points with
/// normals and without a radius, given or their own; see is_point_surface), or a particle file or sequence.
class SurfaceSource {
 public:
  enum class Kind { Scene, Mesh, Grid, Points, Particles };

  /// Looks at the inputs and reads what every frame needs. Several inputs are the frames of a sequence.
  /// Throws IoError, or InvalidInput for options that do not go with the input.
  SurfaceSource(const std::vector<std::string>& inputs, SourceOptions options, const RunControl& run = {});
  ~SurfaceSource();
  SurfaceSource(SurfaceSource&&) noexcept;

  Kind kind() const { return kind_; }
  std::string_view kind_name() const;
  double frames_per_second() const;
  /// Frames to work on; empty when the input is one surface and no frame was asked for.
  const std::vector<long>& frames() const { return frames_; }
  /// Every frame the input offers: a scene's range, a sequence's files; empty for a single surface.
  std::vector<long> all_frames() const;
  /// The surface at a frame (or the only one).
  Surface open(std::optional<long> frame, const RunControl& run = {}) const;
  /// Text that tells sources of other surfaces apart: names of the inputs (of a single file the content too) and options.
  std::string settings() const;
  /// The scene, if the input is one.
  const Document* document() const { return document_ ? &*document_ : nullptr; }

 private:
  void told(const io::ReadReport& read) const {
    if (options_.on_read) options_.on_read(read);
  }

  Kind kind_ = Kind::Scene;
  std::vector<std::string> inputs_;
  SourceOptions options_;
  std::vector<long> frames_;
  std::optional<Document> document_;
  std::unique_ptr<field::Field> field_;  // of a scene, mesh, grid or points: frames are poses of it
  bool open_ = false;
  std::optional<io::ParticleSequence> sequence_;
};

}  // namespace meniscus::scene
