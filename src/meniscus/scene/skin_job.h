#pragma once

#include <meniscus/band/skin.h>
#include <meniscus/io/geometry.h>
#include <meniscus/io/sequence.h>
#include <meniscus/mesh/mesh.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace meniscus::scene {

/// A particle sequence in, an animated mesh with velocities out.
struct SkinJobOptions {
  band::SkinOptions skin;
  double fps = 24;                   ///< frames per second of the sequence
  std::string output;                ///< mesh per frame: "skin.####.ply" (obj, vtp, usda, stl as well)
  std::optional<std::string> grids;  ///< level set per frame: "skin.####.vdb"
  bool resume = false;               ///< go on after the last frame that an earlier run of the same settings finished
  io::WriteOptions write;
};

/// What was made of one frame.
struct SkinJobFrame {
  long frame = 0;
  std::string path;
  std::size_t vertices = 0, triangles = 0;
  Box bounds;
  band::SkinReport skin;
  double seconds = 0;
  bool kept = false;  ///< finished by an earlier run
};

struct SkinJobReport {
  std::vector<SkinJobFrame> frames;
  io::ReadReport reading;
  std::vector<io::Warning> warnings;
};

/// The mesh of a skin: closed, with N, v (units per second) and the particles' attributes carried over.
mesh::Mesh skin_mesh(const band::Skin& skin, const RunControl& run = {});

/// Runs a skin over the sequence and writes a mesh per frame (and, with ParaView or USD formats, the collection that ties
/// them), each whole or not at all, with a manifest. `on_frame` hears of every frame once it is on disk.
/// A run that was killed and resumed leaves the same bytes as one that was not.
/// Throws InvalidInput for settings or an output pattern without meaning, IoError, ResourceLimit, Cancelled.
SkinJobReport run_skin_job(const io::ParticleSequence& particles, const SkinJobOptions& options,
                           const std::function<void(const SkinJobFrame&)>& on_frame = {}, RunControl run = {});

}  // namespace meniscus::scene
