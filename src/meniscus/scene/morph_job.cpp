#include <meniscus/scene/morph_job.h>

#include <numeric>

namespace meniscus::scene {
namespace {

class LivingMorph final : public LivingSurface {
 public:
  LivingMorph(const field::Field& from, const field::Field& to, const band::MorphOptions& options, const RunControl& run)
      : morph_(from, to, options, {}, run) {}

  void advance(std::size_t, const RunControl& run) override { report = morph_.next(run); }
  const band::Band& band() const override { return morph_.band(); }
  std::vector<Vec3> velocities(std::span<const Vec3> at, const RunControl& run) const override {
    return morph_.velocities(at, run);
  }
  nlohmann::json state() override { return {{"frame", morph_.frame()}}; }
  void resume(std::size_t index, band::Band band, const nlohmann::json&, const RunControl&) override {
    morph_.resume(static_cast<int>(index), std::move(band));
  }

  band::MorphReport report;

 private:
  band::Morph morph_;
};

}  // namespace

void run_morph_job(const field::Field& from, const field::Field& to, const MorphJobOptions& options,
                   const std::function<void(const MorphJobFrame&)>& on_frame, RunControl run) {
  LivingMorph morph(from, to, options.morph, run);
  std::vector<long> frames(static_cast<std::size_t>(options.morph.frames));
  std::iota(frames.begin(), frames.end(), 1);
  const band::MorphOptions& m = options.morph;
  const nlohmann::json settings{
      {"shapes", options.shapes}, {"voxel", m.voxel}, {"frames", m.frames}, {"fps", m.fps}, {"tension", m.tension}};
  write_sequence(
      morph, frames, options.output, settings.dump(),
      [&](const FrameRecord& record) {
        if (on_frame) on_frame({record, record.kept ? band::MorphReport{} : morph.report});
      },
      run);
}

}  // namespace meniscus::scene
