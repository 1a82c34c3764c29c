#pragma once

#include <meniscus/io/frames.h>
#include <meniscus/io/geometry.h>

#include <memory>

namespace meniscus::io {

/// What to do about a frame that is not there.
enum class Missing {
  Error,  ///< throw before anything is read
  Skip,   ///< leave the frame out
  Hold    ///< show the frame before it once more; an error for the first
};

struct SequenceOptions {
  std::optional<std::vector<long>> frames;  ///< wanted frames; when not given, all from the first to the last there is
  Missing missing = Missing::Error;
  ReadOptions read;
};

/// The frames of a particle (or mesh) animation: one pattern, several files, or one LAMMPS dump with all steps in it (frame
/// 1 is its first). A gap is a frame that is wanted and not there; without a list of wanted frames, one that breaks the
/// regular step of those that are. Frames are read on demand, as they are: counts, identities and attributes may change from
/// one to the next (see note_changes). Copies are cheap; reading is safe from several threads.
class ParticleSequence {
 public:
  /// Throws InvalidInput for no input, two frames of one number; IoError for a pattern without files or a gap.
  explicit ParticleSequence(const std::vector<std::string>& inputs, SequenceOptions options = {});

  /// Frames to show, ascending; read() takes these and no others.
  const std::vector<long>& frames() const { return frames_; }
  /// Frames among them that hold an earlier one.
  const std::vector<long>& held() const { return held_; }
  /// The file behind a frame.
  const std::string& file(long frame) const { return shown(frame).path; }

  points::Cloud read(long frame, ReadReport* report = nullptr) const;
  Geometry read_geometry(long frame, ReadReport* report = nullptr) const;

 private:
  class Dump;
  const FrameFile& shown(long frame) const;
  void choose_frames(const std::vector<FrameFile>& there);

  SequenceOptions options_;
  std::vector<long> frames_;
  std::vector<long> held_;
  std::vector<FrameFile> shown_;  ///< for frames_[i], the frame and file it shows
  std::shared_ptr<const Dump> dump_;
};

/// Warns when an attribute of `before` is gone or a new one is there, and when an identity of `after` is there twice.
void note_changes(const points::Cloud& before, const points::Cloud& after, const std::string& where, ReadReport& report);

}  // namespace meniscus::io
