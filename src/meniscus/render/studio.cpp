#include <meniscus/render/studio.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace meniscus::render {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kKeyStrength = 1.0;
constexpr double kRimStrength = 0.35;

const Vec3 kZenith(0.42, 0.435, 0.46);
const Vec3 kHorizon(0.33, 0.34, 0.355);
const Vec3 kFloor(0.24, 0.235, 0.23);

// A direction given as (right, up, back) shares of the camera's axes, levelled: up is the world's up.
Vec3 from_camera(const Camera& camera, double right, double up, double back) {
  const Vec3 world_up = camera.up.normalized();
  const Vec3 view = (camera.position - camera.target).normalized();
  const Vec3 side = world_up.cross(view).normalized();
  const Vec3 level = side.cross(world_up);
  return (right * side + up * world_up + back * level).normalized();
}

double power6(double x) { return x * x * x * x * x * x; }

// Share of a normal distribution of that width about x that falls within [-half, half].
double blurred_box(double x, double half, double width) {
  const double s = 1 / (std::numbers::sqrt2 * width);
  return 0.5 * (std::erf((x + half) * s) - std::erf((x - half) * s));
}

}  // namespace

Axes::Axes(const Vec3& along) : z(along) {
  x = (std::abs(z.y()) < 0.9 ? Vec3(Vec3::UnitY()) : Vec3(Vec3::UnitX())).cross(z).normalized();
  y = z.cross(x);
}

Studio::Studio(const Lights& lights, const Camera& camera)
    : up_(camera.up.normalized()),
      key_(lights.key_direction ? Vec3(lights.key_direction->normalized()) : from_camera(camera, -0.85, 0.95, 0.5)),
      rim_(from_camera(camera, 0.75, 0.55, -0.75)),
      key_cosine_(std::cos(lights.key_size * kPi / 180)),
      key_half_(std::tan(std::clamp(lights.key_size * kPi / 180, 0.03, 1.0))),
      key_color_(lights.key * kKeyStrength * Vec3(1.0, 0.975, 0.94)),
      rim_color_(lights.key * kRimStrength * Vec3(0.94, 0.97, 1.0)),
      fill_(lights.fill) {}

Vec3 Studio::towards_key(const Vec2& u) const {
  const double c = 1 - u.x() * (1 - key_cosine_);
  const double s = std::sqrt(std::max(0.0, 1 - c * c));
  const double phi = 2 * kPi * u.y();
  return key_.to_world(Vec3(s * std::cos(phi), s * std::sin(phi), c));
}

Vec3 Studio::dome(const Vec3& direction) const {
  const double height = direction.dot(up_);
  if (height < 0) return fill_ * (kHorizon + (kFloor - kHorizon) * std::min(1.0, -4 * height));
  const double glow = power6(std::max(0.0, direction.dot(rim_.z)));
  return fill_ * (kHorizon + (kZenith - kHorizon) * height) + glow * rim_color_;
}

Vec3 Studio::dome_irradiance(const Vec3& normal) const {
  const double height = 0.5 + 0.5 * normal.dot(up_);
  const Vec3 above = 0.33 * kHorizon + 0.67 * kZenith;
  const double glow = 0.0625 * (1 + normal.dot(rim_.z)) * (1 + normal.dot(rim_.z));
  return fill_ * (kFloor + (above - kFloor) * height) + glow * rim_color_;
}

Vec3 Studio::mirrored_dome(const Vec3& direction, double roughness) const {
  const double height = direction.dot(up_);
  // A rough surface sees the horizon as a soft step.
  const double step = 0.5 + 0.5 * std::tanh(height / (0.06 + roughness * roughness));
  const Vec3 above = kHorizon + (kZenith - kHorizon) * std::max(0.0, height);
  return fill_ * (kFloor + (above - kFloor) * step);
}

Vec3 Studio::lamp(const Axes& axes, const Vec2& half_size, const Vec3& color, const Vec3& direction,
                  double roughness) const {
  const double z = direction.dot(axes.z);
  if (!(z > 0)) return Vec3::Zero();
  const Vec2 at(direction.dot(axes.x) / z, direction.dot(axes.y) / z);
  const double width = 0.012 + roughness * roughness;
  const double share = blurred_box(at.x(), half_size.x(), width) * blurred_box(at.y(), half_size.y(), width);
  // The same irradiance from a smaller lamp means a brighter lamp; irradiance 1 stands for pi.
  const double solid_angle = 4 * half_size.x() * half_size.y();
  return color * (share * kPi / std::max(solid_angle, 0.05));
}

Vec3 Studio::mirrored_key(const Vec3& direction, double roughness) const {
  return lamp(key_, Vec2(key_half_, key_half_), key_color_, direction, roughness);
}

Vec3 Studio::mirrored_rim(const Vec3& direction, double roughness) const {
  return lamp(rim_, Vec2(0.12, 0.5), rim_color_, direction, roughness);
}

Vec3 Studio::backdrop(double x, double y) {
  const Vec3 light(0.86, 0.87, 0.88);
  const Vec3 dark(0.40, 0.42, 0.455);
  const double dx = (x - 0.5) / 0.95;
  const double dy = (y - 0.56) / 0.85;
  const double t = std::clamp(std::sqrt(dx * dx + dy * dy), 0.0, 1.0);
  return light + (dark - light) * (t * t * (3 - 2 * t));
}

}  // namespace meniscus::render
