#pragma once

#include <meniscus/band/evolver.h>
#include <meniscus/field/field.h>

#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace meniscus::band {

/// Settings of a metamorphosis. Lengths are world units.
struct MorphOptions {
  double voxel = 0;  ///< edge of a cell, > 0
  int frames = 24;   ///< in all, the first shows A and the last B; >= 2
  double fps = 24;
  double tension = 0;  ///< β, units²/s, while under way; it fades out towards the end
};

/// One frame's account.
struct MorphReport {
  double volume = 0, area = 0;
  double farthest = 0;  ///< largest distance of the surface from B's, voxels
  std::size_t components = 0;
  std::size_t active_nodes = 0;
  int steps = 0;
  bool grown = false;  ///< A and B did not overlap: parts of B began as seeds
};

/// Metamorphosis [DC98]: a surface that begins as A and comes to rest on B, whatever their topology.
///
/// The surface inflates inside B and deflates outside, each point in proportion to its distance from B: all arrive together,
/// eased in and out, and the last frame lies on B. A part of B that A does not overlap grows from a seed at its deepest
/// point; a part of A that B does not overlap shrinks away.
class Morph {
 public:
  /// Both fields must be bounded, or `box` given. Throws InvalidInput, ResourceLimit as band_of().
  Morph(const field::Field& from, const field::Field& to, const MorphOptions& options, const Box& box = {},
        const RunControl& run = {});

  /// Goes to the next frame; the first call gives frame 0, which is A itself.
  MorphReport next(const RunControl& run = {});
  /// Goes on from a band saved after frame number `frame`.
  void resume(int frame, Band band);
  int frame() const { return frame_; }  ///< the frame shown; -1 before the first
  const Band& band() const { return evolver_->band(); }

  /// Velocities of surface points, units per second: the normal part from the evolved potential; a metamorphosis has no
  /// tangential one.
  std::vector<Vec3> velocities(std::span<const Vec3> at, const RunControl& run = {}) const;

 private:
  class Pull;

  MorphOptions options_;
  int frame_ = -1;
  std::vector<Band> seeds_;
  std::shared_ptr<Pull> pull_;
  std::unique_ptr<Evolver> evolver_;
  std::optional<Band> before_;  // at the start of the last sub-step
  double before_step_ = 1;
};

}  // namespace meniscus::band
