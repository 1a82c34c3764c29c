#pragma once

#include <meniscus/band/skin.h>
#include <meniscus/io/sequence.h>
#include <meniscus/scene/living_surface.h>

#include <functional>
#include <vector>

namespace meniscus::scene {

/// A particle sequence in, an animated mesh with velocities out.
struct SkinJobOptions {
  band::SkinOptions skin;
  SequenceOutput output;
};

/// What was made of one frame.
struct SkinJobFrame : FrameRecord {
  band::SkinReport skin;
  std::vector<band::Component> components;
};

/// The mesh of a skin: closed, with N, v (units per second) and the particles' attributes carried over.
mesh::Mesh skin_mesh(const band::Skin& skin, const RunControl& run = {});

/// Runs a skin over the sequence and writes it, see write_sequence(). Returns what the reader had to say.
/// Throws InvalidInput for settings without meaning, and what write_sequence() throws.
io::ReadReport run_skin_job(const io::ParticleSequence& particles, const SkinJobOptions& options,
                            const std::function<void(const SkinJobFrame&)>& on_frame = {}, RunControl run = {});

}  // namespace meniscus::scene
