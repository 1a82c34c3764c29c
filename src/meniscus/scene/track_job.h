#pragma once

#include <meniscus/scene/tracked_surface.h>

#include <functional>
#include <optional>
#include <string>

namespace meniscus::scene {

/// A moving surface in; a mesh or points that are carried along it, with velocities, out.
struct TrackJobOptions {
  TrackOptions track;
  std::optional<std::string> start;  ///< file of a mesh or points to begin with, attributes and all
  SequenceOutput output;             ///< frames per second are the source's
};

/// What was made of one frame.
struct TrackJobFrame : FrameRecord {
  motion::StepReport step;
  std::size_t born = 0;  ///< see TrackStep
};

/// Carries a mesh (or points) over the frames of `source` and writes each: see TrackedSurface and make_frames(). With
/// attributes N, v (of the vertex as written), id and rest (position in the first frame); level sets with the velocity grid.
/// Throws InvalidInput for settings without meaning or a source without frames, IoError, ResourceLimit, Cancelled.
void run_track_job(const SurfaceSource& source, const TrackJobOptions& options,
                   const std::function<void(const TrackJobFrame&)>& on_frame = {}, RunControl run = {});

}  // namespace meniscus::scene
