#include <meniscus/pointset/image_map.h>

#include <meniscus/base/error.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace meniscus::pointset {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// Right, up and towards the viewer of the image.
struct Axes {
  Vec3 right, up, out;
};

Axes axes_of(const Projection& p) {
  if (p.kind == Projection::Kind::Planar) {
    const Vec3 out = -p.direction.normalized(), right = p.up.cross(out).normalized();
    return {right, out.cross(right), out};
  }
  const Vec3 up = p.up.normalized(), right = up.cross(-p.direction).normalized();
  return {right, up, right.cross(up)};
}

GreyImage halved(const GreyImage& image) {
  GreyImage half{(image.width + 1) / 2, (image.height + 1) / 2, {}};
  for (std::size_t y = 0; y < half.height; ++y)
    for (std::size_t x = 0; x < half.width; ++x) {
      const std::size_t x1 = std::min(2 * x + 1, image.width - 1), y1 = std::min(2 * y + 1, image.height - 1);
      half.values.push_back(0.25F * (image.at(2 * x, 2 * y) + image.at(x1, 2 * y) + image.at(2 * x, y1) + image.at(x1, y1)));
    }
  return half;
}

/// Weights of three neighbouring pixels about the middle one, t from −0.5 to 0.5 pixels.
std::array<double, 3> weights(double t) { return {0.5 * (0.5 - t) * (0.5 - t), 0.75 - t * t, 0.5 * (0.5 + t) * (0.5 + t)}; }

}  // namespace

GreyImage coarsened(const GreyImage& image, double size) {
  GreyImage out = image;
  while (out.width > 3 && out.height > 3 && 1.0 / static_cast<double>(out.width) < 0.5 * size) out = halved(out);
  return out;
}

double brightness(const GreyImage& image, double u, double v) {
  if (!(u >= 0 && u <= 1 && v >= 0 && v <= 1)) return 0;
  const double x = u * static_cast<double>(image.width) - 0.5, y = (1 - v) * static_cast<double>(image.height) - 0.5;
  const double mx = std::round(x), my = std::round(y);
  const auto wx = weights(x - mx), wy = weights(y - my);
  const auto pixel = [&](double px, double py) {
    const double cx = std::clamp(px, 0.0, static_cast<double>(image.width - 1));
    const double cy = std::clamp(py, 0.0, static_cast<double>(image.height - 1));
    return static_cast<double>(image.at(static_cast<std::size_t>(cx), static_cast<std::size_t>(cy)));
  };
  double sum = 0;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i)
      sum += wx[static_cast<std::size_t>(i)] * wy[static_cast<std::size_t>(j)] * pixel(mx + i - 1, my + j - 1);
  return sum;
}

void check(const Projection& p) {
  if (!p.origin.allFinite() || !p.direction.allFinite() || !p.up.allFinite())
    throw InvalidInput("the projection of an image must be finite");
  if (!(p.width > 0) || !(p.height > 0) || !std::isfinite(p.width) || !std::isfinite(p.height))
    throw InvalidInput("an image needs a width and a height above 0");
  if (!(p.up.cross(p.direction).norm() > 1e-6 * p.up.norm() * p.direction.norm()))
    throw InvalidInput("up and the direction of an image's projection must not be parallel");
  if (p.kind != Projection::Kind::Planar && p.width > 360)
    throw InvalidInput("an image goes around once at most: 360 degrees");
  if (p.kind == Projection::Kind::Spherical && p.height > 180)
    throw InvalidInput("an image on a sphere is at most 180 degrees high");
}

std::optional<Vec2> image_place(const Projection& p, const Vec3& x) {
  const Axes axes = axes_of(p);
  const Vec3 d = x - p.origin;
  const double right = d.dot(axes.right), up = d.dot(axes.up), out = d.dot(axes.out);
  if (p.kind == Projection::Kind::Planar) return Vec2(right / p.width + 0.5, up / p.height + 0.5);
  const double around = std::hypot(right, out);
  if (!(around > 0)) return std::nullopt;
  const double u = std::atan2(right, out) / kDegree / p.width + 0.5;
  if (p.kind == Projection::Kind::Cylindrical) return Vec2(u, up / p.height + 0.5);
  return Vec2(u, std::atan2(up, around) / kDegree / p.height + 0.5);
}

Vec3 light(const Projection& p, const Vec3& x) {
  if (p.kind == Projection::Kind::Planar) return p.direction.normalized();
  Vec3 d = p.origin - x;
  if (p.kind == Projection::Kind::Cylindrical) d -= d.dot(p.up.normalized()) * p.up.normalized();
  const double length = d.norm();
  return length > 0 ? Vec3(d / length) : p.direction.normalized();
}

}  // namespace meniscus::pointset
