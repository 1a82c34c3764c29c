#include <meniscus/base/error.h>
#include <meniscus/render/geometry.h>
#include <meniscus/render/subject.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace meniscus::render {
namespace {

constexpr double kFarthest = 1e6;  // viewing distances
constexpr std::int32_t kDropped = -1;

void check_lengths(const Attributes& attributes, std::size_t count) {
  for (const Attribute& a : attributes) {
    if (a.size() == count) continue;
    throw InvalidInput("attribute \"" + a.name + "\" has " + std::to_string(a.size()) + " elements for " +
                       std::to_string(count) + " points");
  }
}

bool is_usable_normal(const Vec3& n) { return n.allFinite() && n.squaredNorm() > 0; }

// The attribute as one number per element: itself or its length. Empty when there is none.
std::vector<double> magnitudes(const Attributes& attributes, const std::string& name) {
  const Attribute* a = attributes.find(name);
  if (a == nullptr || a->components == 0) return {};
  std::vector<double> result(a->size());
  std::visit(
      [&](const auto& data) {
        for (std::size_t i = 0; i < result.size(); ++i) {
          if (a->components == 1) {
            result[i] = static_cast<double>(data[i]);
            continue;
          }
          double sum = 0;
          for (std::size_t k = 0; k < a->components; ++k) {
            const auto x = static_cast<double>(data[i * a->components + k]);
            sum += x * x;
          }
          result[i] = std::sqrt(sum);
        }
      },
      a->data);
  return result;
}

/// Values of the colouring attribute for every item (meshes first), and their range.
struct Coloring {
  std::vector<std::vector<double>> values;
  double min = std::numeric_limits<double>::infinity();
  double max = -min;

  explicit Coloring(const Scene& scene) {
    values.resize(scene.meshes.size() + scene.clouds.size());
    if (!scene.color_by) return;
    const ColorBy& by = *scene.color_by;
    std::size_t slot = 0;
    for (const MeshItem& item : scene.meshes) values[slot++] = magnitudes(item.mesh.attributes, by.attribute);
    for (const CloudItem& item : scene.clouds) values[slot++] = magnitudes(item.cloud.attributes, by.attribute);
    for (const auto& list : values) {
      for (const double x : list) {
        if (!std::isfinite(x)) continue;
        min = std::min(min, x);
        max = std::max(max, x);
      }
    }
    require_attribute(scene);
    if (!(min <= max)) min = max = 0;
    min = by.min.value_or(min);
    max = by.max.value_or(max);
    if (!std::isfinite(min) || !std::isfinite(max)) throw InvalidInput("the range of colours must be finite");
  }

  // Items without elements have no values, and no attribute to miss.
  void require_attribute(const Scene& scene) const {
    const auto named = [&](const auto& item_attributes) { return item_attributes.has(scene.color_by->attribute); };
    bool found = scene.meshes.empty() && scene.clouds.empty();
    for (const MeshItem& item : scene.meshes) found = found || item.mesh.positions.empty() || named(item.mesh.attributes);
    for (const CloudItem& item : scene.clouds) found = found || item.cloud.empty() || named(item.cloud.attributes);
    if (!found) throw InvalidInput("nothing in the scene has an attribute \"" + scene.color_by->attribute + "\"");
  }

  // In halves, so that a range of any size does not overflow.
  double position(double x) const {
    if (!(max != min)) return std::isnan(x) ? x : 0.5;
    return (0.5 * x - 0.5 * min) / (0.5 * max - 0.5 * min);
  }
};

/// Carries points of one item into the view frame, at both ends of the exposure.
class Mover {
 public:
  Mover(const ViewFrame& view, const Attributes& attributes, const RenderOptions& options)
      : view_(view), velocities_(attributes.values(attribute::kVelocity, 3)), half_(0.5 * options.shutter / options.fps) {}

  bool moves() const { return half_ > 0 && !velocities_.empty(); }

  /// Adds the point to the surface; false, and nothing done, if it cannot be shown.
  bool add(Surface& surface, std::size_t i, const Vec3& p, double radius) const {
    const Vec3 way = moves() ? Vec3(half_ * Vec3(velocities_[3 * i], velocities_[3 * i + 1], velocities_[3 * i + 2]))
                             : Vec3(Vec3::Zero());
    const Vec3 begin = view_(p - way);
    const Vec3 end = view_(p + way);
    const double r = radius / view_.scale;
    const auto near = [](const Vec3& x) { return x.allFinite() && x.norm() < kFarthest; };
    if (!near(begin) || !near(end) || !(r < kFarthest)) return false;
    const auto packed = [&](const Vec3& x) {
      return Vec4f(static_cast<float>(x.x()), static_cast<float>(x.y()), static_cast<float>(x.z()), static_cast<float>(r));
    };
    surface.begin.push_back(packed(begin));
    if (moves()) surface.end.push_back(packed(end));
    return true;
  }

 private:
  const ViewFrame& view_;
  std::span<const double> velocities_;
  double half_;  // of the exposure, seconds
};

/// Adds colour and normal of element i to the arrays that the surface uses.
struct Dresser {
  std::span<const double> colors;
  const std::vector<double>& values;
  const Coloring& coloring;

  Dresser(const Attributes& attributes, const std::vector<double>& item_values, const Coloring& all)
      : colors(attributes.values(attribute::kColor, 3)), values(item_values), coloring(all) {}

  void add(Surface& surface, std::size_t i) const {
    if (!values.empty()) {
      surface.values.push_back(static_cast<float>(coloring.position(values[i])));
    } else if (!colors.empty()) {
      const auto channel = [&](std::size_t k) { return static_cast<float>(std::clamp(colors[3 * i + k], 0.0, 1.0)); };
      surface.colors.emplace_back(channel(0), channel(1), channel(2));
    }
  }
};

// Smooth normals: the attribute where it is usable, else the mesh's own.
std::vector<Vec3> smooth_normals(const mesh::Mesh& mesh) {
  const auto given = mesh.attributes.values(attribute::kNormal, 3);
  std::vector<Vec3> normals = given.empty() ? mesh::vertex_normals(mesh) : std::vector<Vec3>(mesh.positions.size());
  bool all = true;
  for (std::size_t i = 0; i < given.size() / 3; ++i) {
    normals[i] = Vec3(given[3 * i], given[3 * i + 1], given[3 * i + 2]);
    all = all && is_usable_normal(normals[i]);
  }
  if (all) return normals;
  const std::vector<Vec3> own = mesh::vertex_normals(mesh);
  for (std::size_t i = 0; i < normals.size(); ++i) {
    if (!is_usable_normal(normals[i])) normals[i] = own[i];
  }
  return normals;
}

Vec3f unit(const Vec3& n) { return is_usable_normal(n) ? Vec3f(n.stableNormalized().cast<float>()) : Vec3f(Vec3f::Zero()); }

void check_indices(const mesh::Mesh& mesh) {
  const auto count = static_cast<std::int64_t>(mesh.positions.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::int32_t i : mesh.triangles[t]) {
      if (i >= 0 && i < count) continue;
      throw InvalidInput("triangle " + std::to_string(t) + " uses vertex " + std::to_string(i) + " of " +
                         std::to_string(count));
    }
  }
}

Surface prepared_mesh(const MeshItem& item, const Mover& mover, const Dresser& dresser, RenderReport& report) {
  const mesh::Mesh& mesh = item.mesh;
  check_indices(mesh);
  Surface surface;
  surface.material = item.material;
  surface.wireframe = item.wireframe;

  const std::vector<Vec3> normals = item.smooth ? smooth_normals(mesh) : std::vector<Vec3>();
  std::vector<std::int32_t> place(mesh.positions.size(), kDropped);
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const auto next = static_cast<std::int32_t>(surface.begin.size());
    if (!mover.add(surface, i, mesh.positions[i], 0)) continue;
    place[i] = next;
    if (item.smooth) surface.normals.push_back(unit(normals[i]));
    dresser.add(surface, i);
  }
  for (const Triangle& t : mesh.triangles) {
    const auto at = [&](std::size_t k) { return place[static_cast<std::size_t>(t[k])]; };
    const Triangle moved = {at(0), at(1), at(2)};
    if (moved[0] == kDropped || moved[1] == kDropped || moved[2] == kDropped) {
      ++report.dropped_triangles;
    } else {
      surface.triangles.push_back(moved);
    }
  }
  return surface;
}

// Discs and spheres of the cloud.
std::array<Surface, 2> prepared_cloud(const CloudItem& item, const Mover& mover, const Dresser& dresser,
                                      RenderReport& report) {
  Surface discs;
  discs.kind = Surface::Kind::Discs;
  discs.material = item.material;
  discs.rims = item.rims;
  Surface spheres;
  spheres.kind = Surface::Kind::Spheres;
  spheres.material = item.material;

  const auto normals = item.spheres ? std::span<const double>() : item.cloud.attributes.values(attribute::kNormal, 3);
  const std::vector<double> radii = radii_of(item);
  for (std::size_t i = 0; i < item.cloud.size(); ++i) {
    const Vec3 normal = normals.empty() ? Vec3(Vec3::Zero()) : Vec3(normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]);
    const bool is_disc = is_usable_normal(normal);
    Surface& surface = is_disc ? discs : spheres;
    if (!(radii[i] > 0) || !mover.add(surface, i, item.cloud.positions[i], radii[i])) {
      ++report.dropped_points;
      continue;
    }
    if (is_disc) surface.normals.push_back(unit(normal));
    dresser.add(surface, i);
  }
  return {std::move(discs), std::move(spheres)};
}

}  // namespace

ViewFrame::ViewFrame(const Camera& camera) : origin(camera.target), scale((camera.position - camera.target).norm()) {}

Geometry prepare(const Scene& scene, const ViewFrame& view, const RenderOptions& options) {
  for (const MeshItem& item : scene.meshes) check_lengths(item.mesh.attributes, item.mesh.positions.size());
  for (const CloudItem& item : scene.clouds) check_lengths(item.cloud.attributes, item.cloud.size());
  const Coloring coloring(scene);
  Geometry geometry;
  if (scene.color_by) {
    geometry.color_map = scene.color_by->map;
    geometry.report.color_min = coloring.min;
    geometry.report.color_max = coloring.max;
  }

  const auto keep = [&](Surface&& surface) {
    if (surface.primitives() > 0) geometry.surfaces.push_back(std::move(surface));
  };
  std::size_t slot = 0;
  for (const MeshItem& item : scene.meshes) {
    const Attributes& attributes = item.mesh.attributes;
    keep(prepared_mesh(item, Mover(view, attributes, options), Dresser(attributes, coloring.values[slot++], coloring),
                       geometry.report));
  }
  for (const CloudItem& item : scene.clouds) {
    const Attributes& attributes = item.cloud.attributes;
    for (Surface& surface : prepared_cloud(item, Mover(view, attributes, options),
                                           Dresser(attributes, coloring.values[slot++], coloring), geometry.report)) {
      keep(std::move(surface));
    }
  }
  return geometry;
}

}  // namespace meniscus::render
