#include <meniscus/field/grid_field.h>
#include <meniscus/motion/tracker.h>
#include <meniscus/polygonize/mend.h>
#include <meniscus/polygonize/polygonize.h>
#include <meniscus/scene/identity.h>
#include <meniscus/scene/inherit.h>
#include <meniscus/scene/persistent_mesh.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <memory>
#include <span>
#include <utility>

namespace meniscus::scene {
namespace {

constexpr int kFirstFairing = 10;      // rounds that even out new triangles
constexpr double kLongestEdge = 3;     // voxels
constexpr double kLeastHeight = 0.05;  // of a triangle, voxels
constexpr double kReach = 1;           // voxels from where its velocity takes a vertex to the surface
constexpr double kTurnedOver = 0;      // cosine between a triangle and the surface's normal

std::vector<double> flat(std::span<const Vec3> vectors) {
  std::vector<double> numbers;
  numbers.reserve(3 * vectors.size());
  for (const Vec3& v : vectors) numbers.insert(numbers.end(), {v.x(), v.y(), v.z()});
  return numbers;
}

Vec3 vector(std::span<const double> flat, std::size_t i) { return {flat[3 * i], flat[3 * i + 1], flat[3 * i + 2]}; }

void set_normals(const field::Field& field, mesh::Mesh& mesh, const RunControl& run) {
  const field::JetBatch jets = field::evaluate(field, mesh.positions, field::Order::Gradient, run);
  std::vector<Vec3> normals(mesh.positions.size());
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const Vec3 g = jets.gradient(i);
    normals[i] = g.norm() > 0 ? Vec3(g.normalized()) : Vec3(Vec3::Zero());
  }
  mesh.attributes.set(attribute::kNormal, 3, flat(normals));
}

Attributes born_here(const std::vector<Vec3>& positions) {
  Attributes attributes;
  set_rest(attributes, positions);
  return attributes;
}

}  // namespace

/// The surface of a frame: its samples, the smooth field through them, and the mesh that one would make anew.
struct PersistentMesh::Shape {
  Shape(const LivingSurface& surface, const RunControl& run)
      : voxel(surface.band().voxel()),
        field(std::make_shared<field::Grid>(surface.band().grid()), field::Interpolation::Cubic, run),
        fresh(polygonize::polygonize_grid(*field.grid(), {}, run).mesh) {}

  double voxel;
  field::GridField field;
  mesh::Mesh fresh;
};

MeshChange PersistentMesh::follow(const LivingSurface& surface, double duration, const RunControl& run) {
  const Shape shape(surface, run);
  MeshChange change;
  if (!std::exchange(started_, true)) {
    start(shape, run);
    change.reason = "first";
  } else {
    std::vector<std::uint8_t> bad = carry(surface, shape, duration, run);
    change.carried = mesh_.positions.size();
    change.reason = fault(shape, bad, run);
    if (!change.reason.empty()) mend(shape, bad, change, run);
  }
  set_normals(shape.field, mesh_, run);
  mesh_.attributes.set(attribute::kVelocity, 3, flat(surface.velocities(mesh_.positions, run)));
  return change;
}

void PersistentMesh::start(const Shape& shape, const RunControl& run) {
  mesh_ = shape.fresh;
  motion::fair(shape.field, mesh_, kFirstFairing, run);
  mesh_.attributes = born_here(mesh_.positions);
  number(mesh_.attributes, 0, mesh_.positions.size(), next_id_);
}

/// Velocities are means over the step that led to a frame, so those of the new frame are what brings a vertex there; those
/// of the old frame say where to look for them. Flags the vertices that have lost their sheet.
std::vector<std::uint8_t> PersistentMesh::carry(const LivingSurface& surface, const Shape& shape, double duration,
                                                const RunControl& run) {
  const std::vector<Vec3> from = mesh_.positions;
  const auto v = mesh_.attributes.values(attribute::kVelocity, 3);
  for (std::size_t i = 0; i < from.size(); ++i) mesh_.positions[i] += duration * vector(v, i);
  const std::vector<Vec3> mean = surface.velocities(mesh_.positions, run);
  for (std::size_t i = 0; i < from.size(); ++i) mesh_.positions[i] = from[i] + duration * mean[i];
  std::vector<std::uint8_t> lost;
  motion::project(shape.field, mesh_.positions, std::vector<double>(from.size(), kReach * shape.voxel), run, &lost);
  motion::fair(shape.field, mesh_, fairing_, run);
  set_normals(shape.field, mesh_, run);
  return lost;
}

/// Why the mesh no longer is the surface, or no good mesh of it; empty when it is. Flags more vertices that must go.
std::string PersistentMesh::fault(const Shape& shape, std::vector<std::uint8_t>& bad, const RunControl& run) const {
  const bool lost = std::find(bad.begin(), bad.end(), 1) != bad.end();
  const auto normals = mesh_.attributes.values(attribute::kNormal, 3);
  bool folded = false, stretched = false;
  std::vector<Vec3> middles;
  for (const Triangle& t : mesh_.triangles) {
    const auto at = [&](std::size_t k) -> const Vec3& { return mesh_.positions[static_cast<std::size_t>(t[k])]; };
    const Vec3 a = at(1) - at(0), b = at(2) - at(0), facing = a.cross(b);
    Vec3 outward = Vec3::Zero();
    for (const std::int32_t i : t) outward += vector(normals, static_cast<std::size_t>(i));
    const double longest = std::max({a.norm(), b.norm(), (b - a).norm()});
    const bool turned = !(facing.dot(outward) > kTurnedOver * facing.norm() * outward.norm());
    const bool thin = longest > kLongestEdge * shape.voxel || facing.norm() < kLeastHeight * shape.voxel * longest;
    folded |= turned;
    stretched |= thin;
    if (turned || thin)
      for (const std::int32_t i : t) bad[static_cast<std::size_t>(i)] = 1;
    middles.emplace_back((at(0) + at(1) + at(2)) / 3);
  }
  if (topology_of(mesh_) != topology_of(shape.fresh)) return "topology";
  if (lost) return "lost";
  if (folded) return "folded";
  const field::JetBatch jets = field::evaluate(shape.field, middles, field::Order::Gradient, run);
  for (std::size_t f = 0; f < middles.size() && !stretched; ++f)
    stretched = std::abs(jets.value(f)) > polygonize::kMendDistance * shape.voxel * jets.gradient(f).norm();
  return stretched ? "stretched" : "";
}

void PersistentMesh::mend(const Shape& shape, const std::vector<std::uint8_t>& bad, MeshChange& change,
                          const RunControl& run) {
  polygonize::Mended mended = polygonize::mend(mesh_, bad, shape.fresh, shape.voxel, run);
  change.carried = mended.kept_vertices.size();
  change.regions = std::move(mended.regions);
  motion::fair(shape.field, mended.mesh, kFirstFairing, run, change.carried);
  mended.mesh.attributes = mesh_.positions.empty() ? born_here(mended.mesh.positions)
                                                   : inherited(mesh_, mended.kept_vertices, mended.mesh.positions);
  mesh_ = std::move(mended.mesh);
  number(mesh_.attributes, change.carried, mesh_.positions.size(), next_id_);
}

void PersistentMesh::resume(TrackState state) {
  mesh_ = std::move(state.mesh);
  next_id_ = state.next_id;
  started_ = true;
}

}  // namespace meniscus::scene
