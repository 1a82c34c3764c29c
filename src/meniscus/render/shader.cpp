#include <meniscus/render/shader.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace meniscus::render {
namespace {

constexpr double kLift = 2e-5;      // of the viewing distance: single precision resolves 1e-7
constexpr double kDiscLift = 0.05;  // of the radius: neighbours on a curved surface cut into each other
constexpr double kSharp = 0.866;  // cosine of 30 degrees: a vertex whose normal is farther from a triangle's is on a crease
constexpr double kGroundAlbedo = 0.6;

Vec3 place(const Surface& s, std::size_t i, double time) {
  const Vec3 begin = s.begin[i].head<3>().cast<double>();
  if (s.end.empty()) return begin;
  return begin + time * (s.end[i].head<3>().cast<double>() - begin);
}

double smooth_step(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

Vec3 cosine_direction(const Axes& axes, const Vec2& u) {
  const double r = std::sqrt(u.x());
  const double phi = 2 * std::numbers::pi * u.y();
  return axes.to_world(Vec3(r * std::cos(phi), r * std::sin(phi), std::sqrt(1 - u.x())));
}

// Schlick's; a rough surface does not turn into a mirror at grazing angles.
double fresnel(const Material& m, double cosine) {
  const double c = 1 - std::clamp(cosine, 0.0, 1.0);
  const double grazing = std::max(m.reflectance, (1 - m.roughness) * (1 - m.roughness));
  return m.reflectance + (grazing - m.reflectance) * c * c * c * c * c;
}

// How far (in the triangle's plane) the point is from the nearest edge.
double distance_to_edge(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& weights) {
  const double twice_area = (b - a).cross(c - a).norm();
  return twice_area * std::min({weights.x() / (c - b).norm(), weights.y() / (a - c).norm(), weights.z() / (b - a).norm()});
}

/// The normal with which a triangle's corner is shaded: the vertex's own, or on a crease, where that is a mean of several
/// sheets', the triangle's. Missing normals are zero.
Vec3 corner_normal(const Vec3& vertex, const Vec3& face) { return vertex.dot(face) < kSharp ? face : vertex; }

}  // namespace

Shader::Shader(const Geometry& geometry, const Tracer& tracer, const Studio& studio, std::optional<double> ground,
               Shading shading, double pixel_angle)
    : geometry_(geometry), tracer_(tracer), studio_(studio), ground_(ground), shading_(shading), pixel_angle_(pixel_angle) {}

Interaction Shader::interaction(const Ray& ray, const Hit& hit) const {
  const Surface& s = geometry_.surfaces[hit.surface];
  Interaction at;
  at.material = &s.material;
  at.color = s.material.color;
  const double lift = kLift * std::max(1.0, hit.distance);
  if (s.kind == Surface::Kind::Mesh) {
    on_mesh(s, ray, hit, at, lift);
  } else {
    on_disc_or_sphere(s, ray, hit, at, lift);
  }
  return at;
}

void Shader::on_mesh(const Surface& s, const Ray& ray, const Hit& hit, Interaction& at, double lift) const {
  const Triangle& t = s.triangles[hit.primitive];
  const std::array<std::size_t, 3> i = {static_cast<std::size_t>(t[0]), static_cast<std::size_t>(t[1]),
                                        static_cast<std::size_t>(t[2])};
  const std::array<Vec3, 3> p = {place(s, i[0], ray.time), place(s, i[1], ray.time), place(s, i[2], ray.time)};
  const Vec3 w(1 - hit.u - hit.v, hit.u, hit.v);
  const auto blend = [&](const auto& list) {
    return Vec3(w[0] * list[i[0]].template cast<double>() + w[1] * list[i[1]].template cast<double>() +
                w[2] * list[i[2]].template cast<double>());
  };

  Vec3 face = (p[1] - p[0]).cross(p[2] - p[0]).normalized();
  std::array<Vec3, 3> normals;
  for (std::size_t k = 0; k < 3; ++k)
    normals[k] = s.normals.empty() ? face : corner_normal(s.normals[i[k]].cast<double>(), face);
  Vec3 normal = (w[0] * normals[0] + w[1] * normals[1] + w[2] * normals[2]).normalized();
  at.outward = normal;
  const double side = face.dot(ray.direction) > 0 ? -1 : 1;
  face *= side;
  normal *= side;
  at.normal = normal;

  // Start from the curved surface that the normals describe, so that facets cast no shadow on their smooth neighbours
  // [Hanika 2021, "Hacking the shadow terminator"].
  const Vec3 flat = w[0] * p[0] + w[1] * p[1] + w[2] * p[2];
  Vec3 curved = flat;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 n = side * normals[k];
    curved -= w[static_cast<int>(k)] * std::min(0.0, (flat - p[k]).dot(n)) * n;
  }
  at.position = curved + lift * face;

  if (!s.values.empty()) {
    const double value = w[0] * static_cast<double>(s.values[i[0]]) + w[1] * static_cast<double>(s.values[i[1]]) +
                         w[2] * static_cast<double>(s.values[i[2]]);
    at.color = color_of(geometry_.color_map, value);
  } else if (!s.colors.empty()) {
    at.color = blend(s.colors);
  }
  if (s.wireframe) {
    const double pixel = pixel_angle_ * hit.distance / std::max(0.25, std::abs(face.dot(ray.direction)));
    at.color *= 0.3 + 0.7 * smooth_step(0.35 * pixel, 0.95 * pixel, distance_to_edge(p[0], p[1], p[2], w));
  }
}

void Shader::on_disc_or_sphere(const Surface& s, const Ray& ray, const Hit& hit, Interaction& at, double lift) const {
  const Vec3 center = place(s, hit.primitive, ray.time);
  const auto radius = static_cast<double>(s.begin[hit.primitive].w());
  const Vec3 met = ray.origin + hit.distance * ray.direction;

  if (!s.values.empty()) {
    at.color = color_of(geometry_.color_map, static_cast<double>(s.values[hit.primitive]));
  } else if (!s.colors.empty()) {
    at.color = s.colors[hit.primitive].cast<double>();
  }
  const bool is_disc = s.kind == Surface::Kind::Discs;
  const Vec3 normal = is_disc ? Vec3(s.normals[hit.primitive].cast<double>()) : Vec3((met - center).normalized());
  at.outward = normal;
  at.normal = normal.dot(ray.direction) > 0 ? Vec3(-normal) : normal;
  if (is_disc) {
    if (s.rims) at.color *= 1 - 0.45 * smooth_step(0.78, 0.92, (met - center).norm() / radius);
    at.position = met + std::max(lift, kDiscLift * radius) * at.normal;
  } else {
    at.position = center + (radius + lift) * (at.normal.dot(normal) > 0 ? normal : Vec3(normal * (1 - 2 * lift / radius)));
  }
}

double Shader::distance_to_ground(const Ray& ray) const {
  const double fall = -ray.direction.dot(studio_.up());
  if (!ground_ || !(fall > 0)) return std::numeric_limits<double>::infinity();
  const double height = ray.origin.dot(studio_.up()) - *ground_;
  return height > 0 ? height / fall : std::numeric_limits<double>::infinity();
}

Vec3 Shader::key_light(const Vec3& position, const Vec3& normal, double time, const Vec2& u) const {
  const Vec3 direction = studio_.towards_key(u);
  const double cosine = normal.dot(direction);
  if (!(cosine > 0) || tracer_.blocked({position, direction, time})) return Vec3::Zero();
  return cosine * studio_.key_color();
}

// A surface seen by reflection: key light and an average of the rest.
Vec3 Shader::simple(const Ray& ray, const Hit& hit, const Vec2& u) const {
  const Interaction at = interaction(ray, hit);
  const Vec3 light = key_light(at.position, at.normal, ray.time, u) + 0.6 * studio_.dome_irradiance(at.normal);
  return at.color.cwiseProduct(light);
}

Vec3 Shader::ground_simple(const Vec3& position, double time, const Vec2& u) const {
  return kGroundAlbedo * (key_light(position, studio_.up(), time, u) + 0.8 * studio_.dome_irradiance(studio_.up()));
}

// What reaches the start of the ray from along it; `open`: from the dome itself.
Vec3 Shader::indirect(const Ray& ray, const Sampler& sampler, Use use, bool& open) const {
  const Hit hit = tracer_.nearest(ray);
  const double ground = distance_to_ground(ray);
  open = false;
  if (hit && hit.distance < ground) return simple(ray, hit, sampler.pair(use));
  if (std::isfinite(ground)) {
    return ground_simple(ray.origin + ground * ray.direction + kLift * studio_.up(), ray.time, sampler.pair(use));
  }
  open = true;
  return studio_.dome(ray.direction);
}

Vec3 Shader::lit(const Ray& ray, const Interaction& at, const Sampler& sampler) const {
  const Material& m = *at.material;
  const double facing = -at.normal.dot(ray.direction);
  const double f = fresnel(m, facing);
  const Vec3 mirror = (ray.direction + 2 * facing * at.normal).normalized();

  const Vec3 key = key_light(at.position, at.normal, ray.time, sampler.pair(Use::Key));
  bool open = false;
  const Ray up_ray{at.position, cosine_direction(Axes(at.normal), sampler.pair(Use::Dome)), ray.time};
  const Vec3 dome = indirect(up_ray, sampler, Use::BounceKey, open);
  const Vec3 diffuse = (1 - f) * at.color.cwiseProduct(key + dome);

  Vec3 glossy = Vec3::Zero();
  if (m.mirrors) {
    const Ray mirror_ray{at.position, mirror, ray.time};
    const Hit hit = tracer_.nearest(mirror_ray);
    const double ground = distance_to_ground(mirror_ray);
    if (hit && hit.distance < ground) {
      glossy = simple(mirror_ray, hit, sampler.pair(Use::MirrorKey));
    } else if (std::isfinite(ground)) {
      glossy = ground_simple(at.position + ground * mirror + kLift * studio_.up(), ray.time, sampler.pair(Use::MirrorKey));
    } else {
      glossy = studio_.mirrored_dome(mirror, m.roughness);
    }
    if (!hit) glossy += studio_.mirrored_key(mirror, m.roughness) + studio_.mirrored_rim(mirror, m.roughness);
  } else {
    // The rays that light the surface tell, on average, whether it can see the lamps.
    glossy = studio_.mirrored_dome(mirror, m.roughness) * (open ? 1.0 : 0.5);
    if (key.x() > 0) glossy += studio_.mirrored_key(mirror, m.roughness);
    if (open) glossy += studio_.mirrored_rim(mirror, m.roughness);
  }
  return diffuse + f * glossy;
}

// The light that reaches the ground as a share of what would without the subject. The dome is sampled as a difference from
// its mean, so that open ground has no noise.
Vec3 Shader::shadow_on_ground(const Vec3& position, double time, const Sampler& sampler) const {
  const Vec3 up = studio_.up();
  const Vec2 u = sampler.pair(Use::Key);
  const Vec3 key = key_light(position, up, time, u);
  const Vec3 open_key = std::max(0.0, studio_.towards_key(u).dot(up)) * studio_.key_color();
  const Vec3 direction = cosine_direction(Axes(up), sampler.pair(Use::Dome));
  const Ray ray{position, direction, time};
  const Hit hit = tracer_.nearest(ray);
  const Vec3 mean = studio_.dome_irradiance(up);
  Vec3 dome = mean;
  if (hit) dome += simple(ray, hit, sampler.pair(Use::BounceKey)) - studio_.dome(direction);
  return (key + dome).cwiseMax(0.0).cwiseQuotient(open_key + mean);
}

Shader::Sight Shader::look(const Ray& ray, const Sampler& sampler, const std::optional<Vec3>& backdrop) const {
  const Hit hit = tracer_.nearest(ray);
  const double ground = distance_to_ground(ray);
  if (hit && hit.distance < ground) {
    const Interaction at = interaction(ray, hit);
    if (shading_ == Shading::Flat) return {at.color, 1};
    if (shading_ == Shading::Normal) return {0.5 * (at.outward + Vec3::Ones()), 1};
    return {lit(ray, at, sampler), 1};
  }
  if (!std::isfinite(ground)) return backdrop ? Sight{*backdrop, 1} : Sight{};

  const Vec3 position = ray.origin + ground * ray.direction + kLift * studio_.up();
  const Vec3 share = shadow_on_ground(position, ray.time, sampler);
  if (backdrop) return {backdrop->cwiseProduct(share), 1};
  return {Vec3::Zero(), std::clamp(1 - share.mean(), 0.0, 1.0)};
}

}  // namespace meniscus::render
