// The velocities that tracking writes, seen by the renderer: one blurred picture against the mean of 64 sharp ones of the
// true surface at 64 moments of the exposure.
#include "motion/moving_scenes.h"

#include <meniscus/motion/isometric.h>
#include <meniscus/motion/velocity.h>
#include <meniscus/render/render.h>

#include <gtest/gtest.h>

#include <functional>

namespace meniscus::motion {
namespace {

constexpr int kSubFrames = 64;
constexpr double kExposure = 0.4;  // seconds

render::RenderOptions options(render::Shading shading, int samples) {
  render::RenderOptions o;
  o.width = 56;
  o.height = 42;
  o.samples = samples;
  o.shading = shading;
  o.transparent = true;
  o.fps = 1;
  return o;
}

render::Image draw(const mesh::Mesh& mesh, const render::RenderOptions& o) {
  render::Scene scene;
  scene.meshes.push_back({.mesh = mesh});
  render::Camera camera;
  camera.position = {0, 1.2, 8};
  camera.fov = 22;
  return render::render(scene, camera, o);
}

void set(mesh::Mesh& mesh, std::string_view name, const std::vector<Vec3>& values) {
  std::vector<double> flat;
  for (const Vec3& v : values) flat.insert(flat.end(), {v.x(), v.y(), v.z()});
  mesh.attributes.set(name, 3, std::move(flat));
}

using Picture = std::vector<Eigen::Array4d>;

/// The mean of the pictures of mesh_at(t), t over the exposure about 0.
Picture reference(double exposure, render::Shading shading, const std::function<mesh::Mesh(double)>& mesh_at) {
  Picture mean;
  for (int k = 0; k < kSubFrames; ++k) {
    const render::Image sharp = draw(mesh_at(exposure * ((k + 0.5) / kSubFrames - 0.5)), options(shading, 8));
    mean.resize(sharp.pixels().size(), Eigen::Array4d::Zero());
    for (std::size_t i = 0; i < mean.size(); ++i) {
      const render::Pixel& p = sharp.pixels()[i];
      mean[i] += Eigen::Array4d(p.r, p.g, p.b, p.a) / kSubFrames;
    }
  }
  return mean;
}

/// Root mean square over pixels and channels between `wanted` and the picture of `mesh` blurred by `velocity`.
double error(mesh::Mesh mesh, const std::vector<Vec3>& velocity, double exposure, render::Shading shading,
             const Picture& wanted) {
  set(mesh, "v", velocity);
  auto o = options(shading, 1024);
  o.shutter = exposure;
  const render::Image blurred = draw(mesh, o);
  double sum = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const render::Pixel& p = blurred.pixels()[i];
    sum += (wanted[i] - Eigen::Array4d(p.r, p.g, p.b, p.a)).square().sum();
  }
  return std::sqrt(sum / (4 * static_cast<double>(wanted.size())));
}

TEST(MotionBlur, ShowsTheSurfaceMoveWhateverTheVelocity) {
  const auto f = test::approaching_blobs();
  const auto mesh_at = [&](double t) {
    f->set_time(0.2 + t);
    return test::surface(*f, 0.1);
  };
  const mesh::Mesh now = mesh_at(0);
  f->set_time(0.2);
  const std::vector<Vec3> at_rest(now.positions.size(), Vec3::Zero());
  const Picture wanted = reference(kExposure, render::Shading::Normal, mesh_at);
  const double sharp = error(now, at_rest, kExposure, render::Shading::Normal, wanted);
  EXPECT_GT(sharp, 0.025);
  f->set_time(0.2);
  for (const Velocity kind : {Velocity::Normal, Velocity::Blended, Velocity::Total, Velocity::Isometric}) {
    const Velocities v = velocities(*f, now.positions, {.kind = kind});
    EXPECT_LT(error(now, v.velocity, kExposure, render::Shading::Normal, wanted), 0.35 * sharp) << static_cast<int>(kind);
  }
}

TEST(MotionBlur, CarriesColoursWhereTheyGo) {
  // Painted blobs that turn as one body: colours are carried by the true motion alone.
  const auto f = test::orbiting_blobs();
  f->set_time(0);
  mesh::Mesh now = test::surface(*f, 0.05);
  std::vector<Vec3> paint;
  for (const Vec3& p : now.positions)
    paint.push_back(std::sin(5 * p.x()) * std::sin(5 * p.y()) > 0 ? Vec3(1, 1, 1) : Vec3(0, 0, 0));
  set(now, "Cd", paint);
  const auto mesh_at = [&](double t) {
    mesh::Mesh m = now;
    for (Vec3& p : m.positions)
      p = Vec3(std::cos(t) * p.x() + std::sin(t) * p.z(), p.y(), std::cos(t) * p.z() - std::sin(t) * p.x());
    return m;
  };
  const Picture wanted = reference(kExposure, render::Shading::Flat, mesh_at);
  const auto of = [&](Velocity kind) {
    Velocities v = velocities(*f, now.positions, {.kind = Velocity::Blended});
    if (kind == Velocity::Isometric)
      IsometricSolver(now).solve(now.positions, v);
    else
      v = velocities(*f, now.positions, {.kind = kind});
    return error(now, v.velocity, kExposure, render::Shading::Flat, wanted);
  };
  const double isometric = of(Velocity::Isometric);
  EXPECT_LT(isometric, 0.016);
  EXPECT_GT(of(Velocity::Normal), 3 * isometric);
  EXPECT_GT(of(Velocity::Blended), 1.7 * isometric);
}

}  // namespace
}  // namespace meniscus::motion
