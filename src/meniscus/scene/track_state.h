#pragma once

#include <meniscus/io/geometry.h>
#include <meniscus/mesh/mesh.h>
#include <meniscus/motion/tracker.h>

#include <cstdint>
#include <string>

namespace meniscus::scene {

/// What a tracking job must know beside the frames it has written to go on after the last one, to the last bit.
struct TrackState {
  mesh::Mesh mesh;  ///< without triangles: the points
  motion::References references;
  std::int64_t next_id = 0;
  std::int64_t steps = 0;
};

/// Writes the state whole or not at all (CBOR). Throws IoError.
void save_track_state(const std::string& path, const TrackState& state, const io::WriteOptions& options);

/// Throws IoError for a file that is missing or holds no state.
TrackState load_track_state(const std::string& path);

}  // namespace meniscus::scene
