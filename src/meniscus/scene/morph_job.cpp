#include <meniscus/base/error.h>
#include <meniscus/io/frames.h>
#include <meniscus/polygonize/polygonize.h>
#include <meniscus/scene/morph_job.h>

#include <chrono>

namespace meniscus::scene {

std::vector<MorphJobFrame> run_morph_job(const field::Field& from, const field::Field& to, const MorphJobOptions& options,
                                         const std::function<void(const MorphJobFrame&)>& on_frame, RunControl run) {
  const auto pattern = io::FramePattern::parse(options.output);
  if (!pattern) throw InvalidInput("'" + options.output + "' has no place for the frame number: write, say, m.####.ply");
  band::Morph morph(from, to, options.morph, {}, run);
  std::vector<MorphJobFrame> frames;
  for (int f = 0; f < options.morph.frames; ++f) {
    const auto started = std::chrono::steady_clock::now();
    MorphJobFrame out;
    out.frame = f + 1;
    out.path = pattern->path(out.frame);
    out.morph = morph.next(run);
    mesh::Mesh mesh = polygonize::polygonize_grid(morph.band().grid(), {}, run).mesh;
    std::vector<double> v;
    for (const Vec3& u : morph.velocities(mesh.positions, run)) v.insert(v.end(), {u.x(), u.y(), u.z()});
    mesh.attributes.set("v", 3, std::move(v));
    out.vertices = mesh.positions.size();
    out.triangles = mesh.triangles.size();
    out.bounds = mesh::bounds(mesh);
    io::write_mesh(out.path, mesh, options.write);
    out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    run.progress((f + 1.0) / options.morph.frames, "morph");
    frames.push_back(out);
    if (on_frame) on_frame(out);
  }
  return frames;
}

}  // namespace meniscus::scene
