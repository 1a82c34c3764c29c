#include <meniscus/render/color_map.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace meniscus::render {
namespace {

// OKLab <-> linear sRGB, B. Ottosson, "A perceptual color space for image processing", 2020.
Vec3 rgb_from_oklab(double lightness, double a, double b) {
  const auto cube = [](double x) { return x * x * x; };
  const double l = cube(lightness + 0.3963377774 * a + 0.2158037573 * b);
  const double m = cube(lightness - 0.1055613458 * a - 0.0638541728 * b);
  const double s = cube(lightness - 0.0894841775 * a - 1.2914855480 * b);
  const Vec3 rgb(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
                 -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
                 -0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s);
  return rgb.cwiseMax(0.0).cwiseMin(1.0);
}

Vec3 rgb_from_lch(double lightness, double chroma, double hue_degrees) {
  const double h = hue_degrees * std::numbers::pi / 180;
  return rgb_from_oklab(lightness, chroma * std::cos(h), chroma * std::sin(h));
}

// A spiral through OKLCh: lightness rises linearly while the hue turns from violet to yellow. The chroma keeps it in gamut.
Vec3 sequential(double t) {
  const double hue = 305 - 195 * t;
  const double chroma = 0.125 + 0.02 * t + 0.03 * std::cos(2 * std::numbers::pi * t);
  return rgb_from_lch(0.30 + 0.62 * t, chroma, hue);
}

Vec3 diverging(double t) {
  const double s = std::abs(2 * t - 1);
  return rgb_from_lch(0.93 - 0.45 * s, 0.17 * std::pow(s, 0.8), t < 0.5 ? 256 : 27);
}

}  // namespace

Vec3 color_of(ColorMap map, double t) {
  if (std::isnan(t)) return Vec3::Constant(0.2);
  t = std::clamp(t, 0.0, 1.0);
  return map == ColorMap::Diverging ? diverging(t) : sequential(t);
}

double lightness(const Vec3& c) {
  const double l = std::cbrt(0.4122214708 * c.x() + 0.5363325363 * c.y() + 0.0514459929 * c.z());
  const double m = std::cbrt(0.2119034982 * c.x() + 0.6806995451 * c.y() + 0.1073969566 * c.z());
  const double s = std::cbrt(0.0883024619 * c.x() + 0.2817188376 * c.y() + 0.6299787005 * c.z());
  return 0.2104542553 * l + 0.7936177850 * m - 0.0040720468 * s;
}

}  // namespace meniscus::render
