#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>
#include <meniscus/render/legend.h>
#include <meniscus/render/render.h>
#include <meniscus/render/shader.h>
#include <meniscus/render/subject.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

namespace meniscus::render {
namespace {

constexpr int kTile = 16;

void require(bool condition, const char* message) {
  if (!condition) throw InvalidInput(message);
}

void check(const RenderOptions& o) {
  require(o.width >= 1 && o.height >= 1, "a picture needs at least one pixel in each direction");
  require(o.samples >= 1 && o.samples <= (1 << 20), "the number of samples per pixel must lie between 1 and 2^20");
  require(o.shutter >= 0 && std::isfinite(o.shutter), "the shutter must be open for 0 frames or more");
  require(o.fps > 0 && std::isfinite(o.fps), "frames per second must be positive");
  require(o.exposure > 0 && std::isfinite(o.exposure), "the exposure must be positive");
}

void check(const Camera& c) {
  require(c.position.allFinite() && c.target.allFinite() && c.up.allFinite(), "the camera must be at a finite place");
  require(c.fov > 0 && c.fov < 180, "the camera's field of view must lie between 0 and 180 degrees");
  const Vec3 view = c.target - c.position;
  require(view.norm() > 0, "the camera must not be at its target");
  require(c.up.cross(view).norm() > 1e-6 * c.up.norm() * view.norm(), "the camera must not look along its up vector");
}

void check(const Lights& l) {
  require(l.key >= 0 && std::isfinite(l.key) && l.fill >= 0 && std::isfinite(l.fill), "lights must not be negative");
  require(l.key_size >= 0 && l.key_size <= 80, "the size of the key light must lie between 0 and 80 degrees");
  require(!l.key_direction || (l.key_direction->allFinite() && l.key_direction->norm() > 0),
          "the key light needs a direction");
}

/// Rays through the picture plane, in the view frame.
class Lens {
 public:
  Lens(const Camera& camera, int width, int height) : width_(width), height_(height) {
    back_ = (camera.position - camera.target).normalized();
    right_ = camera.up.cross(back_).normalized();
    up_ = back_.cross(right_);
    slope_ = std::tan(camera.fov * std::numbers::pi / 360);
  }

  /// The ray through (x, y) in pixels from the top left corner.
  Ray ray(double x, double y, double time) const {
    const double sx = slope_ * (2 * x - width_) / height_;
    const double sy = slope_ * (1 - 2 * y / height_);
    return {back_, (sx * right_ + sy * up_ - back_).normalized(), time};
  }
  double pixel_angle() const { return 2 * slope_ / height_; }

 private:
  double width_, height_;
  Vec3 right_, up_, back_;
  double slope_;
};

// Spreads [0, 1) over (-1, 1) with the density of a tent: a pixel borrows from its neighbours, and edges look smooth.
double tent(double u) { return u < 0.5 ? std::sqrt(2 * u) - 1 : 1 - std::sqrt(2 - 2 * u); }

/// Height of the ground along the camera's up, in the view frame.
std::optional<double> ground_height(const Scene& scene, const Camera& camera, const ViewFrame& view, Shading shading) {
  if (!scene.ground.visible || shading != Shading::Studio) return {};
  const Vec3 up = camera.up.normalized();
  double height = std::numeric_limits<double>::infinity();
  if (scene.ground.height) {
    height = *scene.ground.height;
    require(std::isfinite(height), "the height of the ground must be finite");
  } else {
    visit_subject(scene, [&](const Vec3& p, double radius) { height = std::min(height, p.dot(up) - radius); });
  }
  if (!std::isfinite(height)) return {};
  return (height - view.origin.dot(up)) / view.scale;
}

Pixel expose(const Shader& shader, const Lens& lens, const RenderOptions& options, std::uint64_t seed, int x, int y) {
  const PixelSampler pixel(seed, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y),
                           static_cast<std::uint32_t>(options.samples));
  std::optional<Vec3> backdrop;
  if (!options.transparent) backdrop = Studio::backdrop((x + 0.5) / options.width, (y + 0.5) / options.height);
  Vec3 color = Vec3::Zero();
  double alpha = 0;
  for (int s = 0; s < options.samples; ++s) {
    const Sampler sampler{pixel, static_cast<std::uint32_t>(s)};
    const Vec2 u = sampler.pair(Use::Pixel);
    const double time = options.shutter > 0 ? sampler.pair(Use::Time).x() : 0.5;
    const Shader::Sight sight = shader.look(lens.ray(x + 0.5 + tent(u.x()), y + 0.5 + tent(u.y()), time), sampler, backdrop);
    color += sight.color;
    alpha += sight.alpha;
  }
  const double n = options.samples;
  return {static_cast<float>(color.x() / n), static_cast<float>(color.y() / n), static_cast<float>(color.z() / n),
          static_cast<float>(alpha / n)};
}

void expose_all(Image& image, const Shader& shader, const Lens& lens, const RenderOptions& options, const RunControl& run) {
  const int across = (options.width + kTile - 1) / kTile;
  const int down = (options.height + kTile - 1) / kTile;
  const auto tiles = static_cast<std::size_t>(across) * static_cast<std::size_t>(down);
  std::atomic<std::size_t> done{0};
  parallel_for(tiles, 1, run, [&](std::size_t tile) {
    const int left = static_cast<int>(tile % static_cast<std::size_t>(across)) * kTile;
    const int top = static_cast<int>(tile / static_cast<std::size_t>(across)) * kTile;
    for (int y = top; y < std::min(top + kTile, options.height); ++y) {
      for (int x = left; x < std::min(left + kTile, options.width); ++x) {
        image.at(x, y) = expose(shader, lens, options, run.seed(), x, y);
      }
    }
    run.progress(static_cast<double>(++done) / static_cast<double>(tiles), "render");
  });
}

}  // namespace

Image render(const Scene& scene, const Camera& camera, const RenderOptions& options, RenderReport* report, RunControl run) {
  check(options);
  check(camera);
  check(scene.lights);
  Image image(options.width, options.height);
  const ViewFrame view(camera);
  const Geometry geometry = prepare(scene, view, options);
  const Tracer tracer(geometry.surfaces, run);
  const Studio studio(scene.lights, camera);
  const Lens lens(camera, options.width, options.height);
  const Shader shader(geometry, tracer, studio, ground_height(scene, camera, view, options.shading), options.shading,
                      lens.pixel_angle());
  expose_all(image, shader, lens, options, run);

  if (options.tone_map && options.shading == Shading::Studio) tone_map(image, options.exposure);
  const RenderReport& outcome = geometry.report;
  if (options.legend && outcome.color_min && options.shading != Shading::Normal) {
    draw_legend(image, geometry.color_map, scene.color_by->attribute, *outcome.color_min, *outcome.color_max);
  }
  if (report != nullptr) *report = outcome;
  return image;
}

}  // namespace meniscus::render
