#include <meniscus/base/error.h>
#include <meniscus/io/file_bytes.h>
#include <meniscus/io/format.h>
#include <meniscus/io/lammps.h>
#include <meniscus/io/sequence.h>

#include <algorithm>
#include <limits>

namespace meniscus::io {
namespace {

/// The regular distance between frames: the smallest there is.
long step_of(const std::vector<FrameFile>& files) {
  long step = std::numeric_limits<long>::max();
  for (std::size_t i = 1; i < files.size(); ++i) step = std::min(step, files[i].frame - files[i - 1].frame);
  return step;
}

std::vector<long> regular_frames(const std::vector<FrameFile>& there) {
  if (there.size() < 2) return {there.front().frame};
  std::vector<long> frames;
  const long step = step_of(there);
  std::size_t next = 0;
  for (long f = there.front().frame; next < there.size(); f += step) {
    while (next < there.size() && there[next].frame <= f) frames.push_back(there[next++].frame);
    if (next < there.size() && frames.back() != f) frames.push_back(f);
    if (frames.size() > 1'000'000) throw InvalidInput("more than a million frames");
  }
  return frames;
}

}  // namespace

/// A LAMMPS dump and where its steps start. Plain files are read a step at a time; gzip has to stay in memory.
class ParticleSequence::Dump {
 public:
  Dump(std::string path, const ReadOptions& options) : path_(std::move(path)), limit_(options.memory_limit) {
    if (begins_with_gzip(path_)) {
      bytes_ = load_file(path_, limit_);
      const std::vector<std::size_t> starts = lammps_frames(bytes_);
      starts_.assign(starts.begin(), starts.end());
      end_ = bytes_.size();
    } else {
      end_ = scan_file(path_, "ITEM: TIMESTEP", starts_);
    }
  }

  std::size_t size() const { return starts_.size(); }

  std::string step(std::size_t i) const {
    const std::uint64_t begin = starts_[i], end = i + 1 < starts_.size() ? starts_[i + 1] : end_;
    if (!bytes_.empty()) return bytes_.substr(begin, end - begin);
    return load_part(path_, begin, end - begin, limit_);
  }

 private:
  std::string path_;
  std::uint64_t limit_;
  std::string bytes_;
  std::vector<std::uint64_t> starts_;
  std::uint64_t end_ = 0;
};

ParticleSequence::ParticleSequence(const std::vector<std::string>& inputs, SequenceOptions options)
    : options_(std::move(options)) {
  if (inputs.empty()) throw InvalidInput("a sequence needs at least one file");
  std::vector<FrameFile> there;
  const auto pattern = inputs.size() == 1 ? FramePattern::parse(inputs[0]) : std::nullopt;
  if (pattern) {
    there = pattern->existing();
    if (there.empty()) throw IoError(inputs[0], "no file fits this pattern");
  } else {
    there = number_files(inputs);
  }
  const std::string extension = format_of_path(inputs[0]);
  if (inputs.size() == 1 && !pattern && inputs[0] != "-" && is_lammps_extension(extension)) {
    dump_ = std::make_shared<Dump>(inputs[0], options_.read);
    if (dump_->size() == 0) throw IoError(inputs[0], "not a LAMMPS dump: no 'ITEM: TIMESTEP'");
    there.clear();
    for (std::size_t i = 0; i < dump_->size(); ++i) there.push_back({static_cast<long>(i) + 1, inputs[0]});
  }
  choose_frames(there);
}

void ParticleSequence::choose_frames(const std::vector<FrameFile>& there) {
  for (const long frame : options_.frames ? *options_.frames : regular_frames(there)) {
    const auto at =
        std::upper_bound(there.begin(), there.end(), frame, [](long f, const FrameFile& x) { return f < x.frame; });
    const bool found = at != there.begin() && std::prev(at)->frame == frame;
    if (!found && options_.missing == Missing::Skip) continue;
    if (!found && options_.missing == Missing::Error)
      throw IoError(there.front().path,
                    "frame " + std::to_string(frame) + " is missing (frames " + std::to_string(there.front().frame) +
                        " to " + std::to_string(there.back().frame) + " were looked at); --missing skip or hold goes on");
    if (at == there.begin())
      throw IoError(there.front().path,
                    "frame " + std::to_string(frame) + " is missing, and there is none before it to hold");
    frames_.push_back(frame);
    shown_.push_back(*std::prev(at));
    if (!found) held_.push_back(frame);
  }
  if (frames_.empty()) throw IoError(there.front().path, "none of the wanted frames is there");
}

const FrameFile& ParticleSequence::shown(long frame) const {
  const auto at = std::lower_bound(frames_.begin(), frames_.end(), frame);
  if (at == frames_.end() || *at != frame) throw InvalidInput("the sequence has no frame " + std::to_string(frame));
  return shown_[static_cast<std::size_t>(at - frames_.begin())];
}

Geometry ParticleSequence::read_geometry(long frame, ReadReport* report) const {
  const FrameFile& from = shown(frame);
  if (!dump_) return io::read_geometry(from.path, options_.read, report);
  ReadOptions options = options_.read;
  options.format = "lammps";
  options.frame = 0;
  const std::string bytes = dump_->step(static_cast<std::size_t>(from.frame - 1));
  return read_geometry_bytes(from.path + " (time step " + std::to_string(from.frame) + ")", bytes, options, report);
}

points::Cloud ParticleSequence::read(long frame, ReadReport* report) const {
  Geometry g = read_geometry(frame, report);
  if (g.kind == Geometry::Kind::Cloud) return std::move(g.cloud);
  return {std::move(g.mesh.positions), std::move(g.mesh.attributes)};
}

void note_changes(const points::Cloud& before, const points::Cloud& after, const std::string& where, ReadReport& report) {
  for (const Attribute& a : before.attributes)
    if (!after.attributes.has(a.name))
      warn(report, "attribute-vanished", "attribute '" + a.name + "' is gone in this frame", where);
  for (const Attribute& a : after.attributes)
    if (!before.attributes.has(a.name))
      warn(report, "attribute-appeared", "attribute '" + a.name + "' is new in this frame", where);
  const auto ids = after.attributes.integers(attribute::kId);
  std::vector<std::int64_t> sorted(ids.begin(), ids.end());
  std::sort(sorted.begin(), sorted.end());
  const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
  if (twice != sorted.end())
    warn(report, "duplicate-ids", "identity " + std::to_string(*twice) + " is there more than once", where);
}

}  // namespace meniscus::io
