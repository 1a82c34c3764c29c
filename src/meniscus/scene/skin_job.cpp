#include <meniscus/base/error.h>
#include <meniscus/scene/skin_job.h>

#include <filesystem>

namespace meniscus::scene {
namespace {

nlohmann::json optional(const std::optional<double>& v) { return v ? nlohmann::json(*v) : nlohmann::json(); }

/// Everything that determines the frames, as text: what a manifest compares.
std::string settings_text(const io::ParticleSequence& particles, const SkinJobOptions& o) {
  const auto name = [](const std::string& path) { return std::filesystem::path(path).filename().string(); };
  nlohmann::json j;
  const band::SkinOptions& s = o.skin;
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
  j["fps"] = o.output.fps;
  for (const long f : particles.frames()) j["inputs"].push_back({f, name(particles.file(f))});
  return j.dump();
}

/// Gives vertices what particles have, unless the mesh has it already.
void carry_attributes(const band::Skin& skin, mesh::Mesh& mesh, const RunControl& run) {
  for (const Attribute& a : skin.carried(mesh.positions, {"P", "N", "v", "id", "pscale"}, run)) {
    if (mesh.attributes.has(a.name)) continue;
    if (a.is_integer())
      mesh.attributes.set_integers(a.name, a.components, std::get<1>(a.data));
    else
      mesh.attributes.set(a.name, a.components, std::get<0>(a.data));
  }
}

/// A skin that reads its particles as it goes.
class LivingSkin final : public LivingSurface {
 public:
  LivingSkin(const io::ParticleSequence& particles, const SkinJobOptions& options)
      : particles_(particles), skin_(options.skin), fps_(options.output.fps) {}

  void advance(std::size_t index, const RunControl& run) override {
    const std::vector<long>& frames = particles_.frames();
    const points::Cloud cloud = particles_.read(frames[index], &reading);
    report = skin_.advance(cloud, static_cast<double>(index > 0 ? frames[index] - frames[index - 1] : 1) / fps_, run);
  }
  const band::Band& band() const override { return skin_.band(); }
  const std::vector<band::Component>& components() { return skin_.components(); }
  std::vector<Vec3> velocities(std::span<const Vec3> at, const RunControl& run) const override {
    return skin_.velocities(at, run);
  }
  void dress(mesh::Mesh& mesh, const RunControl& run) const override {
    LivingSurface::dress(mesh, run);
    carry_attributes(skin_, mesh, run);
  }
  nlohmann::json state() override {
    nlohmann::json goals = nlohmann::json::array();
    const band::Skin::State s = skin_.state();
    for (const auto& g : s.goals) goals.push_back(optional(g));
    return {{"goals", goals}, {"owed", s.owed}};
  }
  void resume(std::size_t index, band::Band band, const nlohmann::json& state, const RunControl&) override {
    if (!state.contains("goals")) throw InvalidInput("the saved state is not a skin's");
    band::Skin::State s;
    s.owed = state.value("owed", 1.0);
    for (const auto& g : state["goals"])
      s.goals.push_back(g.is_number() ? std::optional<double>(g.get<double>()) : std::nullopt);
    skin_.resume(std::move(band), s, particles_.read(particles_.frames()[index]), 1 / fps_);
  }

  band::SkinReport report;
  io::ReadReport reading;

 private:
  const io::ParticleSequence& particles_;
  band::Skin skin_;
  double fps_;
};

}  // namespace

mesh::Mesh skin_mesh(const band::Skin& skin, const RunControl& run) {
  mesh::Mesh mesh = mesh_of(skin.band(), run);
  std::vector<double> v;
  for (const Vec3& u : skin.velocities(mesh.positions, run)) v.insert(v.end(), {u.x(), u.y(), u.z()});
  mesh.attributes.set(attribute::kVelocity, 3, std::move(v));
  carry_attributes(skin, mesh, run);
  return mesh;
}

io::ReadReport run_skin_job(const io::ParticleSequence& particles, const SkinJobOptions& options,
                            const std::function<void(const SkinJobFrame&)>& on_frame, RunControl run) {
  LivingSkin skin(particles, options);
  write_sequence(
      skin, particles.frames(), options.output, settings_text(particles, options),
      [&](const FrameRecord& record) {
        if (!on_frame) return;
        SkinJobFrame frame{record, {}, {}};
        if (!record.kept) {
          frame.skin = skin.report;
          frame.components = skin.components();
        }
        on_frame(frame);
      },
      run);
  return skin.reading;
}

}  // namespace meniscus::scene
