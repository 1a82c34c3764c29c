#include "frame_report.h"

#include <meniscus/io/frames.h>
#include <meniscus/scene/file_field.h>
#include <meniscus/scene/skin_job.h>

#include <fmt/format.h>

#include <fstream>
#include <memory>

namespace meniscus::cli {
namespace {

struct SkinVerb {
  std::vector<std::string> files;
  std::string frames, missing = "error", kernel = "averaged", volume = "hold", droplets = "keep";
  std::optional<double> radius, voxel, tension, carry, memory;
  band::SkinShells shells;
  double follow = band::SkinOptions{}.follow;
  int min_neighbours = 0;
  bool strict = false;
  SequenceFlags output;

  void run(Session& session) const;
  scene::SkinJobOptions options(Session& session, const io::ParticleSequence& sequence) const;
};

/// Bytes that the machine has to spare now.
double free_memory() {
  std::ifstream info("/proc/meminfo");
  for (std::string line; std::getline(info, line);)
    if (line.rfind("MemAvailable:", 0) == 0) return 1024 * std::stod(line.substr(13));
  return 4e9;
}

scene::SkinJobOptions SkinVerb::options(Session& session, const io::ParticleSequence& sequence) const {
  scene::SkinJobOptions o;
  o.output = output.output(session, sequence.frames());
  band::SkinOptions& s = o.skin;
  const auto known = radius ? radius : scene::default_radius(sequence.read(sequence.frames().front()));
  if (!known) throw UsageError("the particles do not tell their radius: give --radius");
  s.radius = *known;
  if (!radius) session.say(fmt::format("radius {:.4g} (from the first frame; --radius to change)", s.radius));
  s.voxel = voxel;
  s.follow = follow;
  s.tension = tension;
  s.carry = carry;
  s.hold_volume = volume == "hold";
  s.surface.min_neighbours = min_neighbours;
  s.surface.kernel = kernel == "blobs"         ? band::ParticleKernel::Blobs
                     : kernel == "anisotropic" ? band::ParticleKernel::Anisotropic
                                               : band::ParticleKernel::Averaged;
  s.shells = shells;
  s.keep_droplets = droplets == "keep";
  s.max_bricks = static_cast<std::size_t>(memory.value_or(0.75 * free_memory() / 1e9) * 1e9 / band::kBytesPerBrick) + 1;
  return o;
}

nlohmann::json row(const scene::SkinJobFrame& f) {
  const band::SkinReport& s = f.skin;
  nlohmann::json parts = nlohmann::json::array();
  for (const band::Component& c : f.components)
    parts.push_back({{"volume", c.volume}, {"goal", c.goal ? nlohmann::json(*c.goal) : nlohmann::json()}, {"area", c.area}});
  return {{"frame", f.frame},
          {"volume", s.volume},
          {"volume_goal", s.volume_goal},
          {"volume_error", s.worst_volume_error},
          {"area", s.area},
          {"components", s.components},
          {"parts", parts},
          {"triangles", f.triangles},
          {"active_nodes", s.active_nodes},
          {"substeps", s.substeps},
          {"courant", s.max_courant},
          {"flicker", s.flicker},
          {"velocity_residual", s.velocity_residual},
          {"particles", s.particles},
          {"strays", s.strays},
          {"lost", s.lost},
          {"dropped", s.dropped},
          {"seconds", f.seconds}};
}

void SkinVerb::run(Session& session) const {
  const RunControl control = session.run();
  for (const std::string& f : files) session.add_input(f);
  io::SequenceOptions sequence_options;
  try {
    if (!frames.empty()) sequence_options.frames = io::parse_frames(frames);
  } catch (const InvalidInput& e) {
    throw UsageError(std::string("--frames: ") + e.what());
  }
  sequence_options.missing = missing == "skip"   ? io::Missing::Skip
                             : missing == "hold" ? io::Missing::Hold
                                                 : io::Missing::Error;
  const io::ParticleSequence sequence(files, sequence_options);
  const scene::SkinJobOptions job = options(session, sequence);
  session.report()["frames"] = nlohmann::json::array();
  double worst = 0;
  std::size_t dropped = 0, lost = 0;
  const auto on_frame = [&](const scene::SkinJobFrame& f) {
    report_frame(session, f, row(f));
    if (f.kept) return;
    session.say(fmt::format("{}: {} triangles, volume {:.5g}, {} components, {:.2f} s", f.path, grouped(f.triangles),
                            f.skin.volume, f.skin.components, f.seconds));
    worst = std::max(worst, f.skin.worst_volume_error);
    dropped += f.skin.dropped;
    lost = std::max(lost, f.skin.lost);
  };
  const io::ReadReport reading = scene::run_skin_job(sequence, job, on_frame, control);
  session.warn(reading);
  if (dropped > 0)
    session.warn("dropped-particles", fmt::format("{} particles with unusable numbers were left out", dropped));
  if (lost > 0)
    session.warn("lost-particles",
                 fmt::format("up to {} particles a frame are in no skin: {}", grouped(lost),
                             job.skin.keep_droplets ? "they are too small for the voxels; make --voxel smaller"
                                                    : "the tension has eaten them; --droplets keep shows them"));
  if (strict && worst > 0.005) session.fail_check(fmt::format("a component's volume is off by {:.2g} %", 100 * worst));
  session.timing("skin");
  control.progress(1);
}

}  // namespace

void add_skin(CLI::App& app, Session& session) {
  CLI::App* verb =
      app.add_subcommand("skin",
                         "A smooth, steady, volume-keeping animated mesh with velocities from a particle sequence.\n\n"
                         "Example: meniscus skin drops.lammpstrj --fps 1 --radius 0.8 --min-neighbours 3 -o skin.####.ply");
  auto state = std::make_shared<SkinVerb>();
  verb->add_option("particles", state->files, "particle files, a pattern such as f.####.vtk, or a dump with many steps")
      ->required();
  verb->add_option("--radius", state->radius, "of particles, world units, where they have none; default: from their spacing")
      ->check(CLI::PositiveNumber);
  verb->add_option("--voxel", state->voxel, "cell size, world units; default: half the radius")->check(CLI::PositiveNumber);
  verb->add_option("--kernel", state->kernel, "how particles make a surface: averaged (default), blobs, anisotropic")
      ->check(CLI::IsMember({"averaged", "blobs", "anisotropic"}));
  verb->add_option("--tension", state->tension,
                   "surface tension, units²/s: a sphere shrinks by 2B/R; default: 3 x follow x radius² per frame")
      ->check(CLI::NonNegativeNumber);
  verb->add_option(
      "--follow", state->follow,
      "part of its distance to the particles' surface that the skin makes up per frame; less is calmer; default 0.25");
  verb->add_option("--carry", state->carry,
                   "length over which particle velocities are averaged to carry the skin, world units; default: 8 radii");
  verb->add_option("--volume", state->volume, "hold (default): every component keeps its volume; free")
      ->check(CLI::IsMember({"hold", "free"}));
  verb->add_option("--min-neighbours", state->min_neighbours,
                   "particles with fewer others within two radii are strays and make no surface; default 0");
  verb->add_option("--droplets", state->droplets,
                   "those too small for the tension: keep (default; shown as their particles' surface) or free (eaten)")
      ->check(CLI::IsMember({"keep", "free"}));
  verb->add_option(
          "--inner", state->shells.inner,
          "hard bound, radii: the skin covers spheres of this size; above 0.3 single particles show; default 0: none")
      ->check(CLI::Range(0.0, 1.0));
  verb->add_option("--outer", state->shells.outer,
                   "hard bound, radii: the skin stays within spheres of this size; 0: none; default 4")
      ->check(CLI::NonNegativeNumber);
  verb->add_option("--frames", state->frames, "frames to do: 1-48, 1-100x2, 5,9,12-20; default all");
  verb->add_option("--missing", state->missing, "what to do about a missing frame: error (default), skip, hold")
      ->check(CLI::IsMember({"error", "skip", "hold"}));
  verb->add_option(
          "--memory", state->memory,
          "most memory the skin may take, GB; more is refused before the work; default: three quarters of what is free")
      ->check(CLI::PositiveNumber);
  state->output.add_to(*verb);
  verb->add_flag("--strict", state->strict, "exit with 5 when a component's volume drifts by more than 0.5 %");
  session.add_output(*verb);
  session.add_common(*verb);
  verb->callback([state, &session] { state->run(session); });
}

}  // namespace meniscus::cli
