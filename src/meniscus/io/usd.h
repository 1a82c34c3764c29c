#pragma once

#include <meniscus/io/format.h>

#include <string>
#include <vector>

namespace meniscus::io {

class AtomicFile;

/// One frame as USD text: a Mesh or Points prim named "surface" with points, velocities (units per second), normals, display
/// colour, identities and widths (twice the radius); other attributes become primvars. y up, single precision as USD has it.
void write_usda(AtomicFile& file, const GeometryView& geometry, const WriteOptions& options);

/// A frame of a sequence and the file that holds it, relative to the document.
struct SequenceFile {
  double time = 0;  ///< frames for USD, seconds for ParaView
  std::string file;
};

/// A USD document that shows each file at its frame (time) and hides it otherwise.
void write_usd_sequence(const std::string& path, const std::vector<SequenceFile>& frames, const WriteOptions& options);

/// ParaView's `.pvd` collection.
void write_pvd(const std::string& path, const std::vector<SequenceFile>& frames, const WriteOptions& options);

}  // namespace meniscus::io
