#include "cli.h"

#include <meniscus/io/sequence.h>

#include <fmt/format.h>

#include <memory>

namespace meniscus::cli {
namespace {

struct ConvertVerb {
  std::vector<std::string> files;
  std::string frames;
  bool text = false;
  std::string precision;

  void run(Session& session) const;
};

void ConvertVerb::run(Session& session) const {
  const RunControl control = session.run();
  for (const std::string& f : files) session.add_input(f);
  io::SequenceOptions options;
  try {
    if (!frames.empty()) options.frames = io::parse_frames(frames);
  } catch (const InvalidInput& e) {
    throw UsageError(std::string("--frames: ") + e.what());
  }
  const io::ParticleSequence sequence(files, options);
  const bool single = sequence.frames().size() == 1 && !io::FramePattern::parse(session.output());
  const auto paths = single ? std::vector<std::string>{session.output()} : output_paths(session.output(), sequence.frames());
  io::WriteOptions write = session.write_options();
  write.text = text;
  if (!precision.empty()) write.precision = precision == "32" ? io::Precision::Float32 : io::Precision::Float64;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    control.check();
    control.progress(static_cast<double>(i) / static_cast<double>(paths.size()), "convert");
    io::ReadReport report;
    const io::Geometry g = sequence.read_geometry(sequence.frames()[i], &report);
    session.warn(report);
    io::write_geometry(paths[i], g, write);
    const auto frame = single ? std::nullopt : std::optional<long>(sequence.frames()[i]);
    if (g.kind == io::Geometry::Kind::Mesh)
      session.add_output_file(paths[i], g.mesh, frame);
    else
      session.add_output_file(paths[i], g.cloud, frame);
  }
  control.progress(1);
}

}  // namespace

void add_convert(CLI::App& app, Session& session) {
  CLI::App* verb = app.add_subcommand("convert",
                                      "Read one format, write another; attributes ride along.\n\n"
                                      "Example: meniscus convert drops.lammpstrj --frames 1-10 -o drops.####.vtp");
  auto state = std::make_shared<ConvertVerb>();
  verb->add_option("input", state->files, "mesh or particle files, or a pattern for a sequence")->required();
  verb->add_option("--frames", state->frames, "frames to do: 1-48, 1-100x2, 5,9,12-20; default all");
  verb->add_flag("--text", state->text, "the readable variant of the format, where it has one");
  verb->add_option("--precision", state->precision,
                   "bits of written numbers: 32 or 64; default 64 for points, 32 for meshes")
      ->check(CLI::IsMember({"32", "64"}));
  session.add_output(*verb);
  session.add_common(*verb);
  verb->callback([state, &session] { state->run(session); });
}

}  // namespace meniscus::cli
