#include <meniscus/base/error.h>
#include <meniscus/io/atomic_file.h>
#include <meniscus/io/frames.h>
#include <meniscus/io/manifest.h>
#include <meniscus/io/usd.h>
#include <meniscus/io/vdb.h>
#include <meniscus/polygonize/polygonize.h>
#include <meniscus/scene/skin_job.h>

#include <nlohmann/json.hpp>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace meniscus::scene {
namespace {

namespace fs = std::filesystem;

/// Everything that determines the frames, as text: what a manifest compares.
std::string settings_text(const io::ParticleSequence& particles, const SkinJobOptions& o) {
  nlohmann::json j;
  const band::SkinOptions& s = o.skin;
  const auto optional = [](const std::optional<double>& v) { return v ? nlohmann::json(*v) : nlohmann::json(); };
  j["radius"] = s.radius;
  j["voxel"] = optional(s.voxel);
  j["kernel"] = static_cast<int>(s.surface.kernel);
  j["support"] = s.surface.support;
  j["min_neighbours"] = s.surface.min_neighbours;
  j["follow"] = s.follow;
  j["tension"] = optional(s.tension);
  j["hold"] = s.hold_volume;
  j["carry"] = optional(s.carry);
  j["shells"] = {s.shells.inner, s.shells.outer};
  j["droplets"] = s.keep_droplets;
  j["substeps"] = s.max_substeps;
  j["fps"] = o.fps;
  j["output"] = fs::path(o.output).filename().string();
  for (const long f : particles.frames()) j["inputs"].push_back({f, fs::path(particles.file(f)).filename().string()});
  return j.dump();
}

/// The skin's state beside the frames: what a resumed run starts from.
class SavedState {
 public:
  explicit SavedState(const std::string& manifest) : stem_(manifest.substr(0, manifest.rfind(".manifest.json"))) {}

  void save(long frame, band::Skin& skin, io::WriteOptions write) const {
    write.overwrite = true;
    io::write_vdb(name(frame, ".vdb"), skin.band().grid(), write);
    nlohmann::json goals = nlohmann::json::array();
    for (const auto& g : skin.state().goals) goals.push_back(g ? nlohmann::json(*g) : nlohmann::json());
    io::AtomicFile file(name(frame, ".json"), write);
    file.write(nlohmann::json{{"goals", goals}}.dump());
    file.commit();
  }
  void load(long frame, band::Skin& skin, const points::Cloud& particles, double frame_duration) const {
    std::ifstream in(name(frame, ".json"));
    const nlohmann::json j = nlohmann::json::parse(in, nullptr, false);
    if (!j.is_object() || !j.contains("goals")) throw IoError(name(frame, ".json"), "is not a saved skin");
    band::Skin::State state;
    for (const auto& g : j["goals"])
      state.goals.push_back(g.is_number() ? std::optional<double>(g.get<double>()) : std::nullopt);
    skin.resume(band::Band(io::read_vdb(name(frame, ".vdb"))), state, particles, frame_duration);
  }
  bool exists(long frame) const { return fs::exists(name(frame, ".json")) && fs::exists(name(frame, ".vdb")); }
  void remove(long frame) const {
    std::error_code ignored;
    fs::remove(name(frame, ".json"), ignored);
    fs::remove(name(frame, ".vdb"), ignored);
  }

 private:
  std::string name(long frame, const char* extension) const { return stem_ + ".state." + std::to_string(frame) + extension; }
  std::string stem_;
};

io::FramePattern pattern_of(const std::string& path) {
  const auto pattern = io::FramePattern::parse(path);
  if (!pattern) throw InvalidInput("'" + path + "' has no place for the frame number: write, say, skin.####.ply");
  return *pattern;
}

void tie_frames(const SkinJobOptions& options, const std::vector<SkinJobFrame>& frames) {
  const std::string format = io::format_of_path(options.output);
  if (format != "vtp" && format != "usda") return;
  const std::string manifest = io::manifest_path(options.output);
  const std::string stem = manifest.substr(0, manifest.rfind(".manifest.json"));
  std::vector<io::SequenceFile> list;
  for (const SkinJobFrame& f : frames)
    list.push_back({format == "usda" ? static_cast<double>(f.frame) : static_cast<double>(f.frame) / options.fps,
                    fs::path(f.path).filename().string()});
  io::WriteOptions write = options.write;
  write.overwrite = true;
  if (format == "vtp")
    io::write_pvd(stem + ".pvd", list, write);
  else
    io::write_usd_sequence(stem + ".usda", list, write);
}

}  // namespace

mesh::Mesh skin_mesh(const band::Skin& skin, const RunControl& run) {
  mesh::Mesh mesh = polygonize::polygonize_grid(skin.band().grid(), {}, run).mesh;
  const std::vector<Vec3> v = skin.velocities(mesh.positions, run);
  std::vector<double> flat;
  flat.reserve(3 * v.size());
  for (const Vec3& u : v) flat.insert(flat.end(), {u.x(), u.y(), u.z()});
  if (!mesh.attributes.has("N")) mesh.attributes.set("N", 3, {});
  mesh.attributes.set("v", 3, std::move(flat));
  for (const Attribute& a : skin.carried(mesh.positions, {"P", "N", "v", "id", "pscale"}, run)) {
    if (a.is_integer())
      mesh.attributes.set_integers(a.name, a.components, std::get<1>(a.data));
    else
      mesh.attributes.set(a.name, a.components, std::get<0>(a.data));
  }
  return mesh;
}

SkinJobReport run_skin_job(const io::ParticleSequence& particles, const SkinJobOptions& options,
                           const std::function<void(const SkinJobFrame&)>& on_frame, RunControl run) {
  if (!(options.fps > 0)) throw InvalidInput("frames per second must be positive");
  const io::FramePattern pattern = pattern_of(options.output);
  std::optional<io::FramePattern> grid_pattern;
  if (options.grids) grid_pattern = pattern_of(*options.grids);
  const std::vector<long>& frames = particles.frames();
  if (frames.empty()) throw InvalidInput("the particle sequence has no frames");

  SkinJobReport report;
  band::Skin skin(options.skin);
  const std::string manifest_file = io::manifest_path(options.output);
  io::Manifest manifest(manifest_file, settings_text(particles, options));
  const SavedState saved(manifest_file);
  std::size_t first = 0;
  if (options.resume && manifest.resume() > 0) {
    while (first < frames.size() && manifest.has(frames[first])) ++first;
    while (first > 0 && !saved.exists(frames[first - 1])) --first;
    if (first > 0) {
      const long last = frames[first - 1];
      saved.load(last, skin, particles.read(last), 1 / options.fps);
      for (std::size_t i = 0; i < first; ++i) {
        SkinJobFrame kept;
        kept.frame = frames[i];
        kept.path = pattern.path(frames[i]);
        kept.kept = true;
        report.frames.push_back(kept);
      }
    }
  }
  io::WriteOptions write = options.write;
  write.overwrite = options.write.overwrite || options.resume;

  for (std::size_t i = first; i < frames.size(); ++i) {
    const RunControl part = run.part(static_cast<double>(i) / static_cast<double>(frames.size()),
                                     static_cast<double>(i + 1) / static_cast<double>(frames.size()));
    part.progress(0, "frame " + std::to_string(frames[i]));
    const auto started = std::chrono::steady_clock::now();
    SkinJobFrame out;
    out.frame = frames[i];
    out.path = pattern.path(out.frame);
    const points::Cloud cloud = particles.read(out.frame, &report.reading);
    const double duration = static_cast<double>(i > 0 ? frames[i] - frames[i - 1] : 1) / options.fps;
    out.skin = skin.advance(cloud, duration, part);
    const mesh::Mesh mesh = skin_mesh(skin, part);
    out.vertices = mesh.positions.size();
    out.triangles = mesh.triangles.size();
    out.bounds = mesh::bounds(mesh);
    io::write_mesh(out.path, mesh, write);
    if (grid_pattern) io::write_vdb(grid_pattern->path(out.frame), skin.band().grid(), write);
    saved.save(out.frame, skin, write);
    manifest.add(out.frame, out.path, write);
    if (i > 0) saved.remove(frames[i - 1]);
    out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    part.progress(1, "frame " + std::to_string(frames[i]));
    report.frames.push_back(out);
    if (on_frame) on_frame(report.frames.back());
  }
  tie_frames(options, report.frames);
  return report;
}

}  // namespace meniscus::scene
