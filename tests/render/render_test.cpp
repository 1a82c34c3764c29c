#include <meniscus/base/error.h>
#include <meniscus/render/render.h>

#include "tests/render/scenes.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

namespace meniscus::render {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

bool same_bits(const Image& a, const Image& b) {
  return a.width() == b.width() && a.height() == b.height() &&
         std::memcmp(a.pixels().data(), b.pixels().data(), a.pixels().size_bytes()) == 0;
}

double mean_difference(const Image& a, const Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.pixels().size(); ++i) {
    const Pixel& p = a.pixels()[i];
    const Pixel& q = b.pixels()[i];
    sum += static_cast<double>(std::abs(p.r - q.r) + std::abs(p.g - q.g) + std::abs(p.b - q.b) + std::abs(p.a - q.a));
  }
  return sum / static_cast<double>(a.pixels().size());
}

// A mesh, a disc, a sphere, everything that has a position scaled by `scale` about a far centre.
Scene still_life(double scale) {
  Scene scene;
  const Vec3 center = scale * Vec3(3, -2, 5);
  scene.meshes.push_back({.mesh = sphere_mesh(scale, 24, center)});
  points::Cloud cloud;
  cloud.positions = {center + scale * Vec3(1.6, -0.4, 0.3), center + scale * Vec3(-1.5, -0.2, 0.8)};
  cloud.attributes.set("N", 3, {0, 0.3, 1, 0, 0, 0});  // a disc, and a sphere for want of a normal
  cloud.attributes.set("pscale", 1, {0.5 * scale, 0.6 * scale});
  scene.clouds.push_back({.cloud = cloud});
  return scene;
}

RenderOptions small() {
  RenderOptions options;
  options.width = 64;
  options.height = 48;
  options.samples = 8;
  return options;
}

// A sphere at distance d shows a disc whose radius on the picture plane at distance 1 is r / sqrt(d² - r²).
double projected_area(double radius, double distance, double fov, int height) {
  const double pixels = height / (2 * std::tan(fov * std::numbers::pi / 360));
  const double r = pixels * radius / std::sqrt(distance * distance - radius * radius);
  return std::numbers::pi * r * r;
}

TEST(Render, SphereCoversItsProjectedArea) {
  const RenderOptions options = flat(128, 128, 16);
  const double expected = projected_area(1, 5, 30, 128);
  Scene mesh;
  mesh.meshes.push_back({.mesh = sphere_mesh(1, 128)});
  EXPECT_NEAR(total_alpha(render(mesh, from_front(5), options)), expected, 0.003 * expected);
  Scene point;
  point.clouds.push_back({.cloud = {.positions = {Vec3::Zero()}, .attributes = {}}, .radius = 1.0});
  EXPECT_NEAR(total_alpha(render(point, from_front(5), options)), expected, 0.001 * expected);
}

TEST(Render, NormalsPointTowardsTheViewer) {
  Scene scene;
  scene.meshes.push_back({.mesh = sphere_mesh(1, 64)});
  scene.clouds.push_back({.cloud = {.positions = {Vec3(0, 0, 1.2)}, .attributes = {}}, .radius = 0.1});
  RenderOptions options = flat(65, 65, 4);
  options.shading = Shading::Normal;
  const Image image = render(scene, from_front(5), options);
  const Pixel middle = image.at(32, 32);
  EXPECT_NEAR(middle.r, 0.5, 0.02);
  EXPECT_NEAR(middle.g, 0.5, 0.02);
  EXPECT_NEAR(middle.b, 1.0, 0.02);
  EXPECT_GT(image.at(32, 10).g, 0.8);  // the top faces up
  EXPECT_GT(image.at(54, 32).r, 0.8);  // the right faces right
}

TEST(Render, DiscSeenEdgeOnVanishesAndFromTheFrontIsRound) {
  points::Cloud cloud;
  cloud.positions = {Vec3::Zero()};
  const auto covered = [&](const Vec3& normal) {
    cloud.attributes.set("N", 3, {normal.x(), normal.y(), normal.z()});
    Scene scene;
    scene.clouds.push_back({.cloud = cloud, .radius = 1.0});
    return total_alpha(render(scene, from_front(5), flat(96, 96, 16)));
  };
  const double pixels = 96 / (2 * std::tan(std::numbers::pi / 12)) / 5;
  const double front = std::numbers::pi * pixels * pixels;
  EXPECT_LT(covered(Vec3::UnitX()), 1);
  EXPECT_NEAR(covered(Vec3::UnitZ()), front, 0.003 * front);
  EXPECT_NEAR(covered(-7 * Vec3::UnitZ()), front, 0.003 * front);  // from behind, normal of any length
}

TEST(Render, NearerSurfaceWins) {
  const Vec3 red(0.8, 0.1, 0.1);
  const Vec3 blue(0.1, 0.1, 0.8);
  for (const bool red_first : {true, false}) {
    Scene scene;
    scene.meshes.push_back(red_first ? square(1, 0.5, red) : square(1, -0.5, blue));
    scene.meshes.push_back(red_first ? square(1, -0.5, blue) : square(1, 0.5, red));
    const Pixel p = render(scene, from_front(5), flat(33, 33, 4)).at(16, 16);
    EXPECT_NEAR(p.r, 0.8, 1e-6);
    EXPECT_NEAR(p.b, 0.1, 1e-6);
  }
}

TEST(Render, SameBitsForAnyThreadCount) {
  Scene scene = still_life(1);
  auto& mesh = scene.meshes[0].mesh;
  mesh.attributes.set("v", 3, std::vector<double>(3 * mesh.positions.size(), 2.0));
  RenderOptions options = small();
  options.shutter = 0.5;
  const Camera camera = frame(scene);
  const Image one = render(scene, camera, options, nullptr, with_threads(1));
  for (const int threads : {2, 3, 5})
    EXPECT_TRUE(same_bits(one, render(scene, camera, options, nullptr, with_threads(threads))));
  const Image other_seed =
      render(scene, camera, options, nullptr, RunControl({.threads = {}, .seed = 1, .on_progress = {}}));
  EXPECT_FALSE(same_bits(one, other_seed));
}

TEST(Render, SamePictureAtAnyScale) {
  const Scene scene = still_life(1);
  const Image one = render(scene, frame(scene), small());
  for (const double scale : {0.01, 1000.0}) {
    const Scene scaled = still_life(scale);
    EXPECT_LT(mean_difference(one, render(scaled, frame(scaled), small())), 2e-4) << scale;
  }
}

TEST(Render, GroundUnderTheSubjectIsInShadowAndFarGroundIsNot) {
  Scene scene;
  scene.meshes.push_back({.mesh = sphere_mesh(1, 24)});
  RenderOptions options = small();
  options.samples = 64;
  const Camera camera = frame(scene, {.margin = 0.5});
  const Image with = render(scene, camera, options);
  scene.ground.visible = false;
  const Image without = render(scene, camera, options);
  EXPECT_NEAR(with.at(0, 0).g, without.at(0, 0).g, 1e-6);
  double darkest = 1;
  for (int x = 0; x < 64; ++x) {
    for (int y = 24; y < 48; ++y) darkest = std::min(darkest, static_cast<double>(with.at(x, y).g / without.at(x, y).g));
  }
  EXPECT_LT(darkest, 0.6);
}

TEST(Render, GroundHidesWhatIsBelowItAndIsNotSeenFromBelow) {
  Scene scene;
  scene.meshes.push_back({.mesh = sphere_mesh(0.4, 24, Vec3(0, -1, 0))});
  scene.ground.height = 0;
  RenderOptions options = small();
  options.transparent = true;
  Camera camera;
  camera.target = Vec3(0, -1, 0);
  camera.position = Vec3(0, 3, 4);
  EXPECT_LT(total_alpha(render(scene, camera, options)), 1);
  camera.position = Vec3(0, -5, 4);
  EXPECT_GT(total_alpha(render(scene, camera, options)), 20);
}

TEST(Render, TransparentBackgroundHasShadowsButNoBackdrop) {
  Scene scene;
  scene.meshes.push_back({.mesh = sphere_mesh(1, 24)});
  RenderOptions options = small();
  options.transparent = true;
  const Image image = render(scene, frame(scene, {.margin = 0.5}), options);
  EXPECT_EQ(image.at(0, 0).a, 0);
  EXPECT_EQ(image.at(32, 22).a, 1);
  int shaded = 0;
  for (const Pixel& p : image.pixels()) {
    EXPECT_GE(p.a, 0);
    EXPECT_LE(p.a, 1);
    if (p.a > 0.1F && p.a < 0.9F && p.g < 0.01F) ++shaded;
  }
  EXPECT_GT(shaded, 20);
}

TEST(Render, MotionBlurIsTheMeanOfSubFrames) {
  const Vec3 velocity(6, 0, 0);
  const auto scene_at = [&](double time, bool moving) {
    Scene scene;
    scene.meshes.push_back(square(0.3, 0, Vec3(0.5, 0.4, 0.3), time * velocity));
    if (moving) scene.meshes[0].mesh.attributes.set("v", 3, {6, 0, 0, 6, 0, 0, 6, 0, 0, 6, 0, 0});
    points::Cloud cloud;
    cloud.positions = {Vec3(0, 0.8, 0) + time * velocity};
    cloud.attributes.set("N", 3, {0, 0, 1});
    if (moving) cloud.attributes.set("v", 3, {6, 0, 0});
    scene.clouds.push_back({.cloud = cloud, .radius = 0.25});
    return scene;
  };
  RenderOptions options = flat(64, 48, 1024);
  options.shutter = 2;
  options.fps = 10;
  const Camera camera = from_front(5);
  const Image blurred = render(scene_at(0, true), camera, options);

  options.samples = 64;
  options.shutter = 0;
  const int frames = 64;
  std::vector<double> mean(blurred.pixels().size(), 0.0);
  for (int i = 0; i < frames; ++i) {
    const double time = 0.2 * ((i + 0.5) / frames - 0.5);
    const Image frame = render(scene_at(time, false), camera, options);
    for (std::size_t k = 0; k < mean.size(); ++k) mean[k] += static_cast<double>(frame.pixels()[k].r) / frames;
  }
  double worst = 0;
  double brightest = 0;
  for (std::size_t k = 0; k < mean.size(); ++k) {
    worst = std::max(worst, std::abs(mean[k] - static_cast<double>(blurred.pixels()[k].r)));
    brightest = std::max(brightest, mean[k]);
  }
  EXPECT_GT(brightest, 0.1);
  EXPECT_LT(worst, 0.02);
}

TEST(Render, ShutterWithoutVelocityChangesNothingButTheTime) {
  Scene scene;
  scene.meshes.push_back(square(0.3, 0, Vec3(0.5, 0.4, 0.3)));
  RenderOptions options = flat(32, 32, 8);
  const Image sharp = render(scene, from_front(5), options);
  options.shutter = 1;
  EXPECT_TRUE(same_bits(sharp, render(scene, from_front(5), options)));
}

TEST(Render, EmptySceneIsTheBackdrop) {
  const Scene scene;
  const Image image = render(scene, frame(scene), small());
  for (const Pixel& p : image.pixels()) {
    EXPECT_EQ(p.a, 1);
    EXPECT_GT(p.g, 0.2);
  }
  RenderOptions options = small();
  options.transparent = true;
  EXPECT_EQ(total_alpha(render(scene, frame(scene), options)), 0);
}

TEST(Render, UselessVerticesAndPointsAreLeftOutAndCounted) {
  Scene clean;
  clean.meshes.push_back(square(0.5, 0, Vec3(0.5, 0.5, 0.5)));
  clean.clouds.push_back({.cloud = {.positions = {Vec3(1, 0, 0)}, .attributes = {}}, .radius = 0.2});
  const Image expected = render(clean, from_front(5), flat(48, 48, 4));

  for (const double bad : {kNan, std::numeric_limits<double>::infinity(), -1e30, 1e300}) {
    Scene scene = clean;
    auto& mesh = scene.meshes[0].mesh;
    mesh.positions.insert(mesh.positions.begin(), Vec3(0, bad, 0));
    for (Triangle& t : mesh.triangles) t = {t[0] + 1, t[1] + 1, t[2] + 1};
    mesh.triangles.push_back({0, 1, 2});
    auto& cloud = scene.clouds[0].cloud;
    cloud.positions.insert(cloud.positions.begin(), Vec3(bad, 0, 0));
    cloud.positions.push_back(Vec3(0, 0, 1));
    cloud.attributes.set("pscale", 1, {0.2, 0.2, bad});
    scene.clouds[0].radius.reset();
    RenderReport report;
    const Image image = render(scene, from_front(5), flat(48, 48, 4), &report);
    EXPECT_EQ(report.dropped_triangles, 1U) << bad;
    EXPECT_EQ(report.dropped_points, 2U) << bad;
    EXPECT_TRUE(same_bits(image, expected)) << bad;
  }
}

TEST(Render, NonFiniteVelocityIsLeftOutNotFrozen) {
  Scene scene;
  scene.meshes.push_back(square(0.5, 0, Vec3(0.5, 0.5, 0.5)));
  scene.meshes[0].mesh.attributes.set("v", 3, {0, 0, 0, 0, 0, 0, 0, 0, 0, kNan, 0, 0});
  RenderOptions options = flat(16, 16, 1);
  options.shutter = 1;
  RenderReport report;
  (void)render(scene, from_front(5), options, &report);
  EXPECT_EQ(report.dropped_triangles, 1U);
}

TEST(Render, ColorsByScalarAndByLength) {
  Scene scene;
  scene.meshes.push_back(square(10, 0, Vec3::Ones()));
  scene.meshes[0].mesh.attributes.set("speed", 3, {0, 0, 3, 0, 3, 0, 3, 0, 0, 0, 0, 3});
  points::Cloud cloud;
  cloud.positions = {Vec3(0, 0, 1)};
  cloud.attributes.set_integers("speed", 1, {-1});
  scene.clouds.push_back({.cloud = cloud, .radius = 0.3});
  scene.color_by = ColorBy{.attribute = "speed"};
  RenderOptions options = flat(65, 65, 4);
  options.legend = false;
  RenderReport report;
  const Image image = render(scene, from_front(5), options, &report);
  EXPECT_EQ(report.color_min, -1);
  EXPECT_EQ(report.color_max, 3);
  const Vec3 low = color_of(ColorMap::Sequential, 0);
  const Vec3 high = color_of(ColorMap::Sequential, 1);
  EXPECT_NEAR(image.at(32, 32).g, low.y(), 1e-5);
  EXPECT_NEAR(image.at(2, 2).g, high.y(), 1e-5);

  options.legend = true;
  options.width = options.height = 200;
  const Image with_legend = render(scene, from_front(5), options);
  options.legend = false;
  EXPECT_GT(mean_difference(with_legend, render(scene, from_front(5), options)), 0.01);
}

TEST(Render, RefusesWhatHasNoMeaning) {
  Scene scene;
  scene.meshes.push_back(square(1, 0, Vec3::Ones()));
  const Camera camera = from_front(5);
  const auto refused = [&](auto&& change) {
    RenderOptions options = small();
    Camera c = camera;
    Scene s = scene;
    change(options, c, s);
    EXPECT_THROW((void)render(s, c, options), InvalidInput);
  };
  refused([](auto& o, auto&, auto&) { o.width = 0; });
  refused([](auto& o, auto&, auto&) { o.height = -1; });
  refused([](auto& o, auto&, auto&) { o.samples = 0; });
  refused([](auto& o, auto&, auto&) { o.shutter = kNan; });
  refused([](auto& o, auto&, auto&) { o.fps = 0; });
  refused([](auto&, auto& c, auto&) { c.position = c.target; });
  refused([](auto&, auto& c, auto&) { c.up = Vec3::UnitZ(); });
  refused([](auto&, auto& c, auto&) { c.position.x() = kNan; });
  refused([](auto&, auto&, auto& s) { s.meshes[0].mesh.triangles.push_back({0, 1, 4}); });
  refused([](auto&, auto&, auto& s) { s.meshes[0].mesh.attributes.set("v", 3, {1, 2, 3}); });
  refused([](auto&, auto&, auto& s) { s.color_by = ColorBy{.attribute = "missing"}; });
  refused([](auto&, auto&, auto& s) { s.lights.key = -1; });
}

TEST(Render, CancelStops) {
  const Scene scene = still_life(1);
  RunControl run;
  run.cancel();
  EXPECT_THROW((void)render(scene, frame(scene), small(), nullptr, run), Cancelled);
}

/// A roof seen from above whose ridge has the mean normal of its slopes: each slope is shaded with its own up to the ridge.
TEST(Shading, CreasesAreSharp) {
  MeshItem roof;
  roof.mesh.positions = {Vec3(-1, -1, -1), Vec3(-1, 1, -1), Vec3(0, -1, 0), Vec3(0, 1, 0), Vec3(1, -1, -1), Vec3(1, 1, -1)};
  roof.mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {2, 4, 5}, {2, 5, 3}};
  const double s = std::sqrt(0.5);
  roof.mesh.attributes.set(attribute::kNormal, 3, {-s, 0, s, -s, 0, s, 0, 0, 1, 0, 0, 1, s, 0, s, s, 0, s});
  Scene scene;
  scene.meshes.push_back(roof);
  RenderOptions o;
  o.width = o.height = 40;
  o.samples = 4;
  o.shading = Shading::Normal;
  const Image image = render(scene, {.position = Vec3(0, 0, 4), .target = Vec3::Zero(), .up = Vec3::UnitY(), .fov = 20}, o);
  for (int x = 0; x < 40; ++x) {
    if (x > 17 && x < 22) continue;  // the pixels about the ridge see both
    EXPECT_NEAR(2 * image.at(x, 20).r - 1, x < 20 ? -s : s, 1e-3) << x;
  }
}

}  // namespace
}  // namespace meniscus::render
