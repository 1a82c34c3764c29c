#include <meniscus/band/triangle_tree.h>
#include <meniscus/base/parallel.h>
#include <meniscus/mesh/components.h>
#include <meniscus/mesh/stitch.h>
#include <meniscus/mesh/validate.h>
#include <meniscus/polygonize/mend.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

namespace meniscus::polygonize {
namespace {

// Lengths in voxels.
constexpr double kReaches[] = {2, 3, 4, 6, 8};  // how far around a disagreement the old mesh is cut out
constexpr double kGap = 0.75;                   // least width of the strip between what is kept and what is put in
constexpr double kAskew = 0.25;                 // cosine between a triangle and the surface's normal
constexpr std::size_t kScrap = 12;              // open pieces with fewer triangles are not worth joining

const Vec3& corner(const mesh::Mesh& m, const Triangle& t, std::size_t k) {
  return m.positions[static_cast<std::size_t>(t[k])];
}

Vec3 middle(const mesh::Mesh& m, const Triangle& t) { return (corner(m, t, 0) + corner(m, t, 1) + corner(m, t, 2)) / 3; }

std::vector<Vec3> normals_of(const mesh::Mesh& mesh) {
  const auto flat = mesh.attributes.values(attribute::kNormal, 3);
  std::vector<Vec3> normals(mesh.positions.size(), Vec3::Zero());
  for (std::size_t i = 0; i < flat.size() / 3; ++i) normals[i] = Vec3(flat[3 * i], flat[3 * i + 1], flat[3 * i + 2]);
  return normals;
}

bool askew(const mesh::Mesh& mesh, const std::vector<Vec3>& normals, const Triangle& t, double cosine) {
  const Vec3 facing = (corner(mesh, t, 1) - corner(mesh, t, 0)).cross(corner(mesh, t, 2) - corner(mesh, t, 0));
  Vec3 outward = Vec3::Zero();
  for (const std::int32_t v : t) outward += normals[static_cast<std::size_t>(v)];
  return !(facing.dot(outward) > cosine * facing.norm() * outward.norm());
}

/// The points of `points` that are farther than `bound` from the tree's surface.
std::vector<Vec3> far_from(const band::TriangleTree& tree, const std::vector<Vec3>& points, double bound,
                           const RunControl& run) {
  std::vector<std::uint8_t> is_far(points.size());
  parallel_for(points.size(), 256, run,
               [&](std::size_t i) { is_far[i] = tree.distance(points[i], bound) >= bound ? 1 : 0; });
  std::vector<Vec3> result;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (is_far[i] != 0) result.push_back(points[i]);
  return result;
}

/// Places where the two meshes are not the same surface.
std::vector<Vec3> disagreements(const mesh::Mesh& old, std::span<const std::uint8_t> lost, const mesh::Mesh& fresh,
                                double voxel, const RunControl& run) {
  std::vector<Vec3> places = far_from(band::TriangleTree(old), fresh.positions, kMendDistance * voxel, run);
  std::vector<Vec3> own(old.positions);
  for (const Triangle& t : old.triangles) own.push_back(middle(old, t));
  for (const Vec3& p : far_from(band::TriangleTree(fresh), own, kMendDistance * voxel, run)) places.push_back(p);
  // The fresh mesh has such triangles where it bridges a gap that is narrower than a voxel.
  for (const mesh::Mesh* mesh : {&old, &fresh}) {
    const std::vector<Vec3> normals = normals_of(*mesh);
    for (const Triangle& t : mesh->triangles)
      if (askew(*mesh, normals, t, kAskew)) places.push_back(middle(*mesh, t));
  }
  for (std::size_t i = 0; i < lost.size(); ++i)
    if (lost[i] != 0) places.push_back(old.positions[i]);
  return places;
}

/// A tree over points: triangles without extent.
band::TriangleTree tree_of(const std::vector<Vec3>& points) {
  mesh::Mesh m;
  m.positions = points;
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(points.size()); ++i) m.triangles.push_back({i, i, i});
  return band::TriangleTree(m);
}

/// The triangles of `mesh` all of whose vertices are wanted, with its positions, without touching loops and scraps.
/// `numbers` are those triangles' in `mesh`.
mesh::Mesh part(const mesh::Mesh& mesh, const std::vector<std::uint8_t>& wanted, std::vector<std::int32_t>& numbers) {
  mesh::Mesh result;
  result.positions = mesh.positions;
  numbers.clear();
  const auto keep = [&](std::int32_t f) {
    numbers.push_back(f);
    result.triangles.push_back(mesh.triangles[static_cast<std::size_t>(f)]);
  };
  for (std::int32_t f = 0; f < static_cast<std::int32_t>(mesh.triangles.size()); ++f) {
    const Triangle& t = mesh.triangles[static_cast<std::size_t>(f)];
    if (std::all_of(t.begin(), t.end(), [&](std::int32_t v) { return wanted[static_cast<std::size_t>(v)] != 0; })) keep(f);
  }
  std::vector<std::int32_t> left = mesh::part_touching_loops(result);
  for (std::int32_t& f : left) f = numbers[static_cast<std::size_t>(f)];

  const mesh::Components pieces = mesh::components(result);
  std::vector<std::size_t> size(pieces.count);
  std::vector<std::uint8_t> open(pieces.count);
  for (const std::uint32_t c : pieces.of_triangle) ++size[c];
  for (const mesh::Loop& loop : mesh::boundary_loops(result))
    open[pieces.of_vertex[static_cast<std::size_t>(loop.front())]] = 1;
  result.triangles.clear();
  numbers.clear();
  for (std::size_t f = 0; f < left.size(); ++f) {
    const std::uint32_t c = pieces.of_triangle[f];
    if (open[c] == 0 || size[c] >= kScrap) keep(left[f]);
  }
  return result;
}

/// Appends the used vertices of `piece` and its triangles to `whole`. Returns the vertices' numbers in `piece`.
std::vector<std::int32_t> append(mesh::Mesh& whole, const mesh::Mesh& piece) {
  std::vector<std::int32_t> place(piece.positions.size(), 0);
  for (const Triangle& t : piece.triangles)
    for (const std::int32_t v : t) place[static_cast<std::size_t>(v)] = 1;
  std::vector<std::int32_t> used;
  for (std::size_t i = 0; i < place.size(); ++i) {
    if (place[i] == 0) continue;
    place[i] = static_cast<std::int32_t>(whole.positions.size());
    used.push_back(static_cast<std::int32_t>(i));
    whole.positions.push_back(piece.positions[i]);
  }
  for (const Triangle& t : piece.triangles)
    whole.triangles.push_back({place[static_cast<std::size_t>(t[0])], place[static_cast<std::size_t>(t[1])],
                               place[static_cast<std::size_t>(t[2])]});
  return used;
}

double mean_distance(const mesh::Mesh& mesh, const mesh::Loop& from, const mesh::Loop& to) {
  double sum = 0;
  for (const std::int32_t i : from) {
    double least = std::numeric_limits<double>::infinity();
    for (const std::int32_t j : to)
      least = std::min(least,
                       (mesh.positions[static_cast<std::size_t>(i)] - mesh.positions[static_cast<std::size_t>(j)]).norm());
    sum += least;
  }
  return sum / static_cast<double>(from.size());
}

/// For each loop of the patches the loop of the kept part about it; nothing unless each has a partner of its own.
std::optional<std::vector<std::size_t>> partners(const mesh::Mesh& mesh, const std::vector<mesh::Loop>& patches,
                                                 const std::vector<mesh::Loop>& kept) {
  if (patches.size() != kept.size()) return std::nullopt;
  std::vector<std::size_t> partner(patches.size());
  std::vector<std::uint8_t> taken(kept.size());
  for (std::size_t i = 0; i < patches.size(); ++i) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < kept.size(); ++k) {
      const double d = mean_distance(mesh, patches[i], kept[k]);
      if (d < least) least = d, partner[i] = k;
    }
    if (std::exchange(taken[partner[i]], std::uint8_t{1}) != 0) return std::nullopt;
  }
  return partner;
}

std::vector<Box> boxes_of_pieces(const mesh::Mesh& mesh) {
  const mesh::Components pieces = mesh::components(mesh);
  std::vector<Box> boxes(pieces.count);
  for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    if (pieces.of_vertex[i] != mesh::Components::kUnused) boxes[pieces.of_vertex[i]].extend(mesh.positions[i]);
  return boxes;
}

/// Boxes that overlap become one.
std::vector<Box> merged(std::vector<Box> boxes) {
  for (std::size_t i = 0; i < boxes.size();) {
    std::size_t k = i + 1;
    while (k < boxes.size() && !boxes[i].overlaps(boxes[k])) ++k;
    if (k == boxes.size()) {
      ++i;
      continue;
    }
    boxes[i].extend(boxes[k]);
    boxes.erase(boxes.begin() + static_cast<std::ptrdiff_t>(k));
    i = 0;
  }
  return boxes;
}

class Mender {
 public:
  Mender(const mesh::Mesh& old, const mesh::Mesh& fresh, double voxel, const RunControl& run)
      : old_(old),
        fresh_(fresh),
        voxel_(voxel),
        run_(run),
        old_normals_(normals_of(old)),
        fresh_normals_(normals_of(fresh)) {}

  std::optional<Mended> attempt(const band::TriangleTree& places, double reach) const;

 private:
  std::vector<std::uint8_t> missing_vertices(const mesh::Mesh& kept, const band::TriangleTree& places, double reach) const;
  bool join(Mended& result, std::vector<Vec3>& normals) const;
  bool same_topology(const mesh::Mesh& mesh) const;

  const mesh::Mesh& old_;
  const mesh::Mesh& fresh_;
  double voxel_;
  const RunControl& run_;
  std::vector<Vec3> old_normals_;
  std::vector<Vec3> fresh_normals_;
};

/// Vertices of the fresh mesh that what was kept leaves out.
std::vector<std::uint8_t> Mender::missing_vertices(const mesh::Mesh& kept, const band::TriangleTree& places,
                                                   double reach) const {
  const band::TriangleTree tree(kept);
  const double near = reach + 4 * voxel_;
  std::vector<std::uint8_t> missing(fresh_.positions.size());
  parallel_for(missing.size(), 256, run_, [&](std::size_t i) {
    const Vec3& p = fresh_.positions[i];
    missing[i] = places.distance(p, near) < near && tree.distance(p, kGap * voxel_) >= kGap * voxel_ ? 1 : 0;
  });
  return missing;
}

/// Adds the strips between the loops of kept vertices and those of new ones.
bool Mender::join(Mended& result, std::vector<Vec3>& normals) const {
  mesh::Mesh& mesh = result.mesh;
  std::vector<mesh::Loop> kept;
  std::vector<mesh::Loop> patches;
  for (mesh::Loop& loop : mesh::boundary_loops(mesh)) {
    const bool old = static_cast<std::size_t>(loop.front()) < result.kept_vertices.size();
    (old ? kept : patches).push_back(std::move(loop));
  }
  const auto partner = partners(mesh, patches, kept);
  if (!partner) return false;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const auto strip = mesh::strip_between(mesh, normals, kept[(*partner)[i]], patches[i]);
    if (!strip) return false;
    for (const Triangle& t : *strip)
      if (askew(mesh, normals, t, 0)) return false;
    mesh.triangles.insert(mesh.triangles.end(), strip->begin(), strip->end());
  }
  return true;
}

bool Mender::same_topology(const mesh::Mesh& mesh) const {
  const mesh::Audit audit = mesh::validate(mesh);
  const auto euler = [](const mesh::Mesh& m) {
    return static_cast<long long>(m.positions.size()) - static_cast<long long>(m.triangles.size() / 2);
  };
  return audit.good() && audit.components == mesh::components(fresh_).count && audit.euler == euler(fresh_);
}

std::optional<Mended> Mender::attempt(const band::TriangleTree& places, double reach) const {
  std::vector<std::uint8_t> sound(old_.positions.size());
  parallel_for(sound.size(), 256, run_,
               [&](std::size_t i) { sound[i] = places.distance(old_.positions[i], reach) >= reach ? 1 : 0; });
  Mended result;
  const mesh::Mesh kept = part(old_, sound, result.kept_triangles);
  if (kept.triangles.empty()) return std::nullopt;
  std::vector<std::int32_t> ignored;
  const mesh::Mesh patch = part(fresh_, missing_vertices(kept, places, reach), ignored);
  result.kept_vertices = append(result.mesh, kept);
  const std::vector<std::int32_t> added = append(result.mesh, patch);
  std::vector<Vec3> normals;
  for (const std::int32_t i : result.kept_vertices) normals.push_back(old_normals_[static_cast<std::size_t>(i)]);
  for (const std::int32_t i : added) normals.push_back(fresh_normals_[static_cast<std::size_t>(i)]);
  if (!join(result, normals) || !same_topology(result.mesh)) return std::nullopt;

  mesh::Mesh removed;
  removed.positions = old_.positions;
  for (std::size_t f = 0, k = 0; f < old_.triangles.size(); ++f) {
    if (k < result.kept_triangles.size() && static_cast<std::size_t>(result.kept_triangles[k]) == f)
      ++k;
    else
      removed.triangles.push_back(old_.triangles[f]);
  }
  std::vector<Box> boxes = boxes_of_pieces(removed);
  for (const Box& b : boxes_of_pieces(patch)) boxes.push_back(b);
  result.regions = merged(std::move(boxes));
  return result;
}

}  // namespace

Mended mend(const mesh::Mesh& old, std::span<const std::uint8_t> lost, const mesh::Mesh& fresh, double voxel,
            const RunControl& run) {
  const std::vector<Vec3> places = disagreements(old, lost, fresh, voxel, run);
  if (!old.triangles.empty() && !fresh.triangles.empty()) {
    const Mender mender(old, fresh, voxel, run);
    const band::TriangleTree tree = tree_of(places);
    for (const double reach : kReaches)
      if (auto mended = mender.attempt(tree, reach * voxel)) return std::move(*mended);
  }
  Mended whole;
  whole.mesh.positions = fresh.positions;
  whole.mesh.triangles = fresh.triangles;
  Box everything = mesh::bounds(old);
  everything.extend(mesh::bounds(fresh));
  whole.regions = {everything};
  whole.whole = true;
  return whole;
}

}  // namespace meniscus::polygonize
