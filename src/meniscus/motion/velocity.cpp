#include <meniscus/base/box.h>
#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>
#include <meniscus/motion/local_fit.h>
#include <meniscus/motion/regular.h>
#include <meniscus/motion/velocity.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>

namespace meniscus::motion {
namespace {

constexpr double kResolution = 1e-4;  // of the points' diameter
constexpr double kSpeedBound = 2;     // times the fastest primitive
constexpr Regular kTangentHessian{0.01, 0.1};

double checked(const std::optional<double>& value, const char* what) {
  if (value && !(std::isfinite(*value) && *value >= 0))
    throw InvalidInput(std::string(what) + " must be finite and not negative");
  return value.value_or(-1);
}

double diameter(std::span<const Vec3> points) {
  Box box;
  for (const Vec3& p : points)
    if (p.allFinite()) box.extend(p);
  return box.diameter();
}

/// What (4.2) adds to the tangential velocity `guide`: exact in regular directions, nothing in lost ones. `confidence`
/// becomes that of the worse direction.
Vec3 total_correction(const Vec3& n, double v_n, const Mat3& hessian, const Vec3& gradient_time, const Vec3& guide,
                      double& confidence) {
  Vec3 e[2];
  tangents(n, e[0], e[1]);
  const double a = e[0].dot(hessian * e[0]);
  const double b = e[0].dot(hessian * e[1]);
  const double c = e[1].dot(hessian * e[1]);
  const double angle = 0.5 * std::atan2(2 * b, a - c);
  const double cosine = std::cos(angle);
  const double sine = std::sin(angle);
  const Vec3 direction[2] = {cosine * e[0] + sine * e[1], cosine * e[1] - sine * e[0]};
  const Vec3 load = gradient_time + hessian * (v_n * n);
  const double scale = hessian.norm();
  Vec3 correction = Vec3::Zero();
  confidence = 1;
  for (const Vec3& d : direction) {
    const double eigenvalue = d.dot(hessian * d);
    const double weight = scale > 0 ? kTangentHessian(std::abs(eigenvalue) / scale) : 0;
    confidence = std::min(confidence, weight);
    if (weight > 0) correction += weight * (-d.dot(load) / eigenvalue - d.dot(guide)) * d;
  }
  return correction;
}

/// Points that are worked on together, and what they share.
struct Batch {
  const field::Field& field;
  std::span<const Vec3> points;
  Velocity kind;
  double resolution;
  Velocities& out;
  std::vector<Vec3>& guide;       // tangential part of the material velocity
  std::vector<Vec3>& correction;  // what `Total` adds
  std::vector<double>& material;  // speed

  void block(std::size_t begin, std::size_t end) const;
  void point(std::size_t i, const field::JetView& jets, std::size_t k, const Vec3& stuff) const;
};

void Batch::point(std::size_t i, const field::JetView& jets, std::size_t k, const Vec3& stuff) const {
  const Vec3 g = jets.gradient(k);
  const Mat3 h = jets.hessian(k);
  const double slope = g.norm();
  const double least = resolution * h.norm();
  const bool finite = std::isfinite(jets.value(k)) && std::isfinite(slope) && std::isfinite(least) &&
                      std::isfinite(jets.time(k)) && jets.gradient_time(k).allFinite() && stuff.allFinite();
  if (!finite || !(slope > 0)) {
    out.singular[i] = 1;
    return;
  }
  const Vec3 n = g / slope;
  const double v_n = -jets.time(k) / std::max(slope, least);
  out.normal[i] = n;
  out.normal_speed[i] = v_n;
  out.distance[i] = std::abs(jets.value(k)) / slope;
  out.singular[i] = slope < least ? 1 : 0;
  out.confidence[i] = out.singular[i] != 0 ? 0 : 1;
  out.velocity[i] = v_n * n;
  guide[i] = stuff - n.dot(stuff) * n;
  material[i] = stuff.norm();
  if (kind != Velocity::Total || out.singular[i] != 0) return;
  correction[i] = total_correction(n, v_n, h, jets.gradient_time(k), guide[i], out.confidence[i]);
}

void Batch::block(std::size_t begin, std::size_t end) const {
  const std::size_t n = end - begin;
  field::PositionBatch x(n);
  for (std::size_t k = 0; k < n; ++k) x.set(k, points[begin + k]);
  field::JetBatch jets(n, field::Order::HessianTime);
  field.evaluate(x.view(), jets.view());
  std::vector<double> stuff(3 * n);
  field.material_velocity(x.view(), {stuff.data(), stuff.data() + n, stuff.data() + 2 * n});
  for (std::size_t k = 0; k < n; ++k) point(begin + k, jets.view(), k, {stuff[k], stuff[n + k], stuff[2 * n + k]});
}

/// How much of `change` can be added to `base` with the length of the sum staying within `limit`; all of `base` may.
double share_within(const Vec3& base, const Vec3& change, double limit) {
  if ((base + change).squaredNorm() <= limit * limit) return 1;
  const double a = change.squaredNorm();
  const double b = base.dot(change);
  const double c = base.squaredNorm() - limit * limit;
  if (c >= 0 || !(a > 0)) return 0;
  return std::clamp((std::sqrt(b * b - a * c) - b) / a, 0.0, 1.0);
}

double fastest(const Velocities& v, const std::vector<double>& material) {
  const double most = material.empty() ? 0 : *std::max_element(material.begin(), material.end());
  if (most > 0) return most;
  double normal = 0;
  for (std::size_t i = 0; i < v.normal_speed.size(); ++i)
    if (v.singular[i] == 0) normal = std::max(normal, std::abs(v.normal_speed[i]));
  return normal;
}

}  // namespace

void tangents(const Vec3& normal, Vec3& first, Vec3& second) {
  Eigen::Index smallest = 0;
  normal.cwiseAbs().minCoeff(&smallest);
  Vec3 axis = Vec3::Zero();
  axis[smallest] = 1;
  first = (axis - normal[smallest] * normal).normalized();
  second = normal.cross(first);
}

Velocities velocities(const field::Field& field, std::span<const Vec3> points, const VelocityOptions& options,
                      const RunControl& run) {
  const double given = checked(options.resolution, "the resolution");
  const double speed = checked(options.fastest, "the fastest primitive's speed");
  const std::size_t n = points.size();
  Velocities out{std::vector<Vec3>(n, Vec3::Zero()),
                 std::vector<Vec3>(n, Vec3::Zero()),
                 std::vector<double>(n),
                 std::vector<double>(n),
                 std::vector<double>(n),
                 std::vector<std::uint8_t>(n)};
  std::vector<Vec3> guide(n, Vec3::Zero());
  std::vector<Vec3> correction(n, Vec3::Zero());
  std::vector<double> material(n);
  const double resolution = given >= 0 ? given : kResolution * diameter(points);
  const Batch batch{field, points, options.kind, resolution, out, guide, correction, material};
  parallel_blocks(n, field::kBlock, run, [&](std::size_t begin, std::size_t end) { batch.block(begin, end); });

  if (options.kind == Velocity::Normal) return out;
  const double limit = kSpeedBound * (speed >= 0 ? speed : fastest(out, material));
  parallel_for(n, 1024, run, [&](std::size_t i) {
    const double share = share_within(guide[i], correction[i], limit);
    out.velocity[i] += guide[i] + share * correction[i];
    out.confidence[i] *= share;
  });
  if (options.kind == Velocity::Isometric) fit_rigid_motions(points, options.neighbours, out, run);
  return out;
}

}  // namespace meniscus::motion
