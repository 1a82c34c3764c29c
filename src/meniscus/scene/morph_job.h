#pragma once

#include <meniscus/band/morph.h>
#include <meniscus/scene/living_surface.h>

#include <functional>
#include <string>

namespace meniscus::scene {

/// A metamorphosis as a sequence of meshes with velocities, numbered from 1.
struct MorphJobOptions {
  band::MorphOptions morph;
  SequenceOutput output;
  std::string shapes;  ///< tells both shapes from others: a resumed run must have the same
};

struct MorphJobFrame : FrameRecord {
  band::MorphReport morph;
};

/// Writes every frame, see write_sequence(). Throws InvalidInput, IoError, ResourceLimit, Cancelled.
void run_morph_job(const field::Field& from, const field::Field& to, const MorphJobOptions& options,
                   const std::function<void(const MorphJobFrame&)>& on_frame = {}, RunControl run = {});

}  // namespace meniscus::scene
