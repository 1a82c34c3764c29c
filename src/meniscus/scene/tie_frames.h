#pragma once

#include <meniscus/io/geometry.h>

#include <string>
#include <vector>

namespace meniscus::scene {

/// "out/skin" for the frames "out/skin.####.ply": what files beside the frames are called by.
std::string sequence_stem(const std::string& pattern);

/// Writes the collection that ties the frames of a pattern together: `.pvd` for `.vtp`, `.usda` for `.usda`; nothing for
/// other formats. Replaces an old one. Throws IoError.
void tie_frames(const std::string& pattern, const std::vector<long>& frames, double fps, io::WriteOptions options);

}  // namespace meniscus::scene
