#pragma once

#include <meniscus/band/morph.h>
#include <meniscus/io/geometry.h>

#include <functional>
#include <string>
#include <vector>

namespace meniscus::scene {

/// A metamorphosis as a sequence of meshes with velocities.
struct MorphJobOptions {
  band::MorphOptions morph;
  std::string output;  ///< mesh per frame, numbered from 1: "m.####.ply"
  io::WriteOptions write;
};

struct MorphJobFrame {
  long frame = 0;
  std::string path;
  std::size_t vertices = 0, triangles = 0;
  Box bounds;
  band::MorphReport morph;
  double seconds = 0;
};

/// Writes every frame, closed and with N and v (units per second). `on_frame` hears of each once it is on disk.
/// Throws InvalidInput, IoError, ResourceLimit, Cancelled.
std::vector<MorphJobFrame> run_morph_job(const field::Field& from, const field::Field& to, const MorphJobOptions& options,
                                         const std::function<void(const MorphJobFrame&)>& on_frame = {},
                                         RunControl run = {});

}  // namespace meniscus::scene
