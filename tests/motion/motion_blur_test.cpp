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

/// Two like blobs on the x axis, `before` seconds before they meet at the origin, and their mesh with a vertex on each tip.
struct Meeting {
  std::unique_ptr<field::Field> field;
  mesh::Mesh mesh;
};

Meeting about_to_meet(double before) {
  const field::Blob blobs[] = {{{test::moving("-1+0.5*t"), 0.0, 0.0}, 1.2}, {{test::moving("1-0.5*t"), 0.0, 0.0}, 1.2}};
  Meeting m{field::blobs(field::BlobKernel::Compact, 0.4, blobs), {}};
  // The middle is on the surface when 2 (1 - c²/1.44)³ = 0.4 for centres at ±c.
  const double meeting = (1 - 1.2 * std::sqrt(1 - std::cbrt(0.2))) / 0.5;
  m.field->set_time(meeting - before);
  m.mesh = test::surface(*m.field, 0.1);
  for (const double side : {-1.0, 1.0}) {
    double inside = 0.3;
    double outside = 0;
    for (int k = 0; k < 80; ++k) {
      const double x = (inside + outside) / 2;
      const auto jets = field::evaluate(*m.field, std::vector<Vec3>{{side * x, 0, 0}}, field::Order::Value);
      (jets.value(0) < 0 ? inside : outside) = x;
    }
    std::size_t tip = 0;
    double nearest = 1e9;
    for (std::size_t i = 0; i < m.mesh.positions.size(); ++i) {
      const double distance = (m.mesh.positions[i] - Vec3(side * inside, 0, 0)).norm();
      if (side * m.mesh.positions[i].x() > 0 && distance < nearest) nearest = distance, tip = i;
    }
    m.mesh.positions[tip] = {side * inside, 0, 0};
  }
  return m;
}

TEST(MotionBlur, StreaksStayShortWhereSheetsMeet) {
  const double resolution = 0.025;  // a quarter voxel, as tracking has it
  const double shutter = 0.05;
  for (const double before : {1e-4, 1e-6, 1e-8}) {
    const Meeting m = about_to_meet(before);
    const std::vector<Vec3>& x = m.mesh.positions;
    const auto jets = field::evaluate(*m.field, x, field::Order::HessianTime);
    const Velocities v = velocities(*m.field, x, {.kind = Velocity::Normal, .resolution = resolution});
    const Velocities wild = velocities(*m.field, x, {.kind = Velocity::Normal, .resolution = 0.0});
    double bound = 0;
    double fastest = 0;
    std::size_t flagged = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double radius = jets.gradient(i).norm() / jets.hessian(i).norm();  // of curvature of F
      const double own = std::abs(jets.time(i)) / (resolution * jets.hessian(i).norm());
      EXPECT_EQ(v.singular[i], radius < resolution ? 1 : 0);
      EXPECT_LE(std::abs(v.normal_speed[i]), own * (1 + 1e-12));
      flagged += v.singular[i];
      bound = std::max(bound, own);
      fastest = std::max(fastest, wild.velocity[i].norm());
    }
    EXPECT_GE(flagged, 2u) << "the tips";
    EXPECT_LT(flagged, 20u);
    EXPECT_GT(fastest, 1.3 * bound) << "what the bound is for";
    // No pixel farther from the sharp picture than the longest streak, and one for the pixel itself.
    const auto picture = [&](const std::vector<Vec3>& velocity, double exposure) {
      mesh::Mesh blurred = m.mesh;
      set(blurred, "v", velocity);
      auto o = options(render::Shading::Flat, 64);
      o.shutter = exposure;
      return draw(blurred, o);
    };
    const render::Image sharp = picture(v.velocity, 0);
    const auto reach = [&](const render::Image& image) {
      double farthest = 0;
      const auto covered = [](const render::Image& im, int i, int j) {
        return im.pixels()[static_cast<std::size_t>(j * 56 + i)].a > 0.01;
      };
      for (int j = 0; j < 42; ++j)
        for (int i = 0; i < 56; ++i) {
          if (!covered(image, i, j)) continue;
          double nearest = 1e9;
          for (int l = 0; l < 42; ++l)
            for (int k = 0; k < 56; ++k)
              if (covered(sharp, k, l)) nearest = std::min(nearest, std::hypot(i - k, j - l));
          farthest = std::max(farthest, nearest);
        }
      return farthest;
    };
    const double pixel = 2 * 8 * std::tan(11 * 3.14159265358979323846 / 180) / 42;  // world units at the blobs
    EXPECT_LE(reach(picture(v.velocity, shutter)), bound * shutter / 2 / pixel + 1.5);
  }
}

}  // namespace
}  // namespace meniscus::motion
