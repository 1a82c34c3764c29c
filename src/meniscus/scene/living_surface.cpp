#include <meniscus/base/error.h>
#include <meniscus/io/atomic_file.h>
#include <meniscus/io/frames.h>
#include <meniscus/io/manifest.h>
#include <meniscus/io/vdb.h>
#include <meniscus/polygonize/polygonize.h>
#include <meniscus/scene/living_surface.h>
#include <meniscus/scene/persistent_mesh.h>
#include <meniscus/scene/tie_frames.h>

#include <chrono>
#include <filesystem>
#include <fstream>

namespace meniscus::scene {
namespace {

namespace fs = std::filesystem;

io::FramePattern pattern_of(const std::string& path) {
  const auto pattern = io::FramePattern::parse(path);
  if (!pattern) throw InvalidInput("'" + path + "' has no place for the frame number: write, say, skin.####.ply");
  return *pattern;
}

/// The surface's state beside the frames: what a resumed run starts from.
class SavedState {
 public:
  explicit SavedState(std::string stem) : stem_(std::move(stem)) {}

  void save(long frame, LivingSurface& surface, const std::optional<PersistentMesh>& mesh,
            const io::WriteOptions& write) const {
    if (mesh) save_track_state(name(frame, ".cbor"), mesh->state(), write);
    io::write_vdb(name(frame, ".vdb"), surface.band().grid(), write);
    io::AtomicFile file(name(frame, ".json"), write);
    file.write(surface.state().dump());
    file.commit();
  }
  void load(long frame, std::size_t index, LivingSurface& surface, std::optional<PersistentMesh>& mesh,
            const RunControl& run) const {
    std::ifstream in(name(frame, ".json"));
    const nlohmann::json state = nlohmann::json::parse(in, nullptr, false);
    if (!state.is_object()) throw IoError(name(frame, ".json"), "is not a saved state");
    surface.resume(index, band::Band(io::read_vdb(name(frame, ".vdb"))), state, run);
    if (mesh) mesh->resume(load_track_state(name(frame, ".cbor")));
  }
  bool exists(long frame) const { return fs::exists(name(frame, ".json")) && fs::exists(name(frame, ".vdb")); }
  void remove(long frame) const {
    std::error_code ignored;
    for (const char* extension : {".json", ".vdb", ".cbor"}) fs::remove(name(frame, extension), ignored);
  }

 private:
  std::string name(long frame, const char* extension) const { return stem_ + ".state." + std::to_string(frame) + extension; }
  std::string stem_;
};

void write_grid(const std::string& path, const LivingSurface& surface, bool velocities, const io::WriteOptions& write,
                const RunControl& run) {
  const band::Band& band = surface.band();
  if (!velocities) return io::write_vdb(path, band.grid(), write);
  std::vector<Vec3> at;
  std::vector<std::size_t> node;
  for (std::size_t n = 0; n < band.values().size(); ++n)
    if (std::abs(band.values()[n]) < band.background()) {
      const int i = static_cast<int>(n % band::Band::kBrickNodes);
      at.push_back(band.position(n / band::Band::kBrickNodes, i >> 6, i >> 3 & 7, i & 7));
      node.push_back(n);
    }
  const std::vector<Vec3> v = surface.velocities(at, run);
  std::vector<Vec3> samples(band.values().size(), Vec3::Zero());
  for (std::size_t i = 0; i < v.size(); ++i) samples[node[i]] = v[i];
  io::write_vdb(path, band.grid(), samples, write);
}

}  // namespace

nlohmann::json to_json(const MeshChange& change) {
  nlohmann::json boxes = nlohmann::json::array();
  for (const Box& b : change.regions) {
    const auto corner = [](const Vec3& p) { return nlohmann::json::array({p.x(), p.y(), p.z()}); };
    boxes.push_back(nlohmann::json::array({corner(b.min), corner(b.max)}));
  }
  return {{"remeshed", change.reason}, {"regions", std::move(boxes)}, {"carried", change.carried}};
}

mesh::Mesh mesh_of(const band::Band& band, const RunControl& run) {
  mesh::Mesh mesh = polygonize::polygonize_grid(band.grid(), {}, run).mesh;
  if (!mesh.attributes.has(attribute::kNormal)) mesh.attributes.set(attribute::kNormal, 3, {});
  return mesh;
}

void LivingSurface::dress(mesh::Mesh& mesh, const RunControl& run) const {
  std::vector<double> v;
  v.reserve(3 * mesh.positions.size());
  for (const Vec3& u : velocities(mesh.positions, run)) v.insert(v.end(), {u.x(), u.y(), u.z()});
  mesh.attributes.set(attribute::kVelocity, 3, std::move(v));
}

void write_sequence(LivingSurface& surface, const std::vector<long>& frames, const SequenceOutput& output,
                    const std::string& settings, const std::function<void(const FrameRecord&)>& on_frame, RunControl run) {
  if (!(output.fps > 0)) throw InvalidInput("frames per second must be positive");
  if (frames.empty()) throw InvalidInput("there are no frames to make");
  const io::FramePattern pattern = pattern_of(output.meshes);
  std::optional<io::FramePattern> grid_pattern;
  if (output.grids) grid_pattern = pattern_of(*output.grids);
  io::WriteOptions write = output.write, replace = output.write;
  write.comments.clear();  // the command line differs between a run and its --resume; the frames must not
  write.overwrite = output.write.overwrite || output.resume;
  replace.overwrite = true;

  io::Manifest manifest(io::manifest_path(output.meshes), settings + (output.persistent ? " persistent" : ""));
  const SavedState saved(sequence_stem(output.meshes));
  std::optional<PersistentMesh> persistent;
  if (output.persistent) persistent.emplace();
  std::size_t first = 0;
  if (output.resume && manifest.resume() > 0) {
    while (first < frames.size() && manifest.has(frames[first])) ++first;
    while (first > 0 && !saved.exists(frames[first - 1])) --first;
    if (first > 0) saved.load(frames[first - 1], first - 1, surface, persistent, run);
    for (std::size_t i = 0; i < first && on_frame; ++i)
      on_frame({.frame = frames[i], .path = pattern.path(frames[i]), .kept = true});
  }

  const auto duration = [&](long from, long to) { return static_cast<double>(to - from) / output.fps; };
  for (std::size_t i = first; i < frames.size(); ++i) {
    const double count = static_cast<double>(frames.size());
    const RunControl part = run.part(static_cast<double>(i) / count, static_cast<double>(i + 1) / count);
    part.progress(0, "frame " + std::to_string(frames[i]));
    const auto started = std::chrono::steady_clock::now();
    surface.advance(i, part);
    FrameRecord out{.frame = frames[i], .path = pattern.path(frames[i])};
    if (persistent) out.change = persistent->follow(surface, i > 0 ? duration(frames[i - 1], frames[i]) : 0, part);
    mesh::Mesh mesh = persistent ? persistent->mesh() : mesh_of(surface.band(), part);
    surface.dress(mesh, part);
    out.vertices = mesh.positions.size();
    out.triangles = mesh.triangles.size();
    out.bounds = mesh::bounds(mesh);
    io::write_mesh(out.path, mesh, write);
    if (grid_pattern) write_grid(grid_pattern->path(out.frame), surface, output.velocity_grids, write, part);
    saved.save(out.frame, surface, persistent, replace);
    manifest.add(out.frame, out.path, write, out.change ? to_json(*out.change) : nlohmann::json());
    if (i > 0) saved.remove(frames[i - 1]);
    out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    part.progress(1, "frame " + std::to_string(frames[i]));
    if (on_frame) on_frame(out);
  }
  tie_frames(output.meshes, frames, output.fps, write);
}

}  // namespace meniscus::scene
