#include <meniscus/base/error.h>
#include <meniscus/io/atomic_file.h>
#include <meniscus/io/frames.h>
#include <meniscus/io/vdb.h>
#include <meniscus/polygonize/polygonize.h>
#include <meniscus/scene/living_surface.h>
#include <meniscus/scene/persistent_mesh.h>
#include <meniscus/scene/write_band.h>

#include <fstream>

namespace meniscus::scene {
namespace {

/// A living surface as frames.
class LivingFrames final : public FrameMaker {
 public:
  LivingFrames(LivingSurface& surface, const std::vector<long>& frames, const SequenceOutput& output)
      : surface_(surface), frames_(frames), output_(output) {
    if (output.persistent) persistent_.emplace();
  }

  void make(std::size_t index, FrameRecord& record, const io::WriteOptions& write, const RunControl& run) override {
    surface_.advance(index, run);
    const double since = index > 0 ? static_cast<double>(frames_[index] - frames_[index - 1]) / output_.fps : 0;
    if (persistent_) record.change = persistent_->follow(surface_, since, run);
    mesh::Mesh mesh = persistent_ ? persistent_->mesh() : mesh_of(surface_.band(), run);
    surface_.dress(mesh, run);
    record.vertices = mesh.positions.size();
    record.triangles = mesh.triangles.size();
    record.bounds = mesh::bounds(mesh);
    io::write_mesh(record.path, mesh, write);
    if (!record.grid_path) return;
    const auto at = [&](std::span<const Vec3> x) { return surface_.velocities(x, run); };
    const VelocityAt velocity(at);
    write_band(*record.grid_path, surface_.band(), output_.velocity_grids ? &velocity : nullptr, write);
  }

  std::vector<std::string> state_endings() const override {
    if (persistent_) return {".json", ".vdb", ".cbor"};
    return {".json", ".vdb"};
  }
  void save(const std::string& stem, const io::WriteOptions& write) override {
    if (persistent_) save_track_state(stem + ".cbor", persistent_->state(), write);
    io::write_vdb(stem + ".vdb", surface_.band().grid(), write);
    io::AtomicFile file(stem + ".json", write);
    file.write(surface_.state().dump());
    file.commit();
  }
  void load(const std::string& stem, std::size_t index, const RunControl& run) override {
    std::ifstream in(stem + ".json");
    const nlohmann::json state = nlohmann::json::parse(in, nullptr, false);
    if (!state.is_object()) throw IoError(stem + ".json", "is not a saved state");
    surface_.resume(index, band::Band(io::read_vdb(stem + ".vdb")), state, run);
    if (persistent_) persistent_->resume(load_track_state(stem + ".cbor"));
  }

 private:
  LivingSurface& surface_;
  const std::vector<long>& frames_;
  const SequenceOutput& output_;
  std::optional<PersistentMesh> persistent_;
};

}  // namespace

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
  LivingFrames maker(surface, frames, output);
  make_frames(maker, frames, output, settings + (output.persistent ? " persistent" : ""), on_frame, run);
}

}  // namespace meniscus::scene
