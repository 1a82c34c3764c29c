#include <meniscus/base/parallel.h>
#include <meniscus/polygonize/jumps.h>

#include <algorithm>

namespace meniscus::polygonize {
namespace {

constexpr double kSmall = 0.05;  // voxels by |F|/|∇F|: vertices on the surface are far below, those on a jump mostly above

/// Whether F is too large at each vertex to be on the surface.
std::vector<std::uint8_t> on_jump(const ClippedField& field, double voxel, const std::vector<Vec3>& positions,
                                  const RunControl& run) {
  std::vector<std::uint8_t> jump(positions.size(), 0);
  parallel_blocks(positions.size(), field::kBlock, run, [&](std::size_t begin, std::size_t end) {
    field::PositionBatch x(end - begin);
    for (std::size_t i = begin; i < end; ++i) x.set(i - begin, positions[i]);
    field::JetBatch jets(end - begin, field::Order::Gradient);
    field.evaluate(x.view(), jets.view());
    for (std::size_t i = begin; i < end; ++i)
      jump[i] = std::abs(jets.value(i - begin)) > kSmall * voxel * jets.gradient(i - begin).norm() ? 1 : 0;
  });
  return jump;
}

}  // namespace

std::size_t drop_jumps(const ClippedField& field, double voxel, mesh::Mesh& mesh, const RunControl& run) {
  const std::vector<std::uint8_t> jump = on_jump(field, voxel, mesh.positions, run);
  const std::size_t before = mesh.triangles.size();
  std::erase_if(mesh.triangles, [&](const Triangle& t) {
    return std::any_of(t.begin(), t.end(), [&](std::int32_t v) { return jump[static_cast<std::size_t>(v)] != 0; });
  });
  if (mesh.triangles.size() == before) return 0;

  std::vector<std::int32_t> place(mesh.positions.size(), -1);
  for (const Triangle& t : mesh.triangles)
    for (const std::int32_t v : t) place[static_cast<std::size_t>(v)] = 0;
  std::vector<std::size_t> kept;
  for (std::size_t v = 0; v < place.size(); ++v)
    if (place[v] == 0) {
      place[v] = static_cast<std::int32_t>(kept.size());
      kept.push_back(v);
    }
  for (std::size_t k = 0; k < kept.size(); ++k) mesh.positions[k] = mesh.positions[kept[k]];
  mesh.positions.resize(kept.size());
  mesh.attributes = mesh.attributes.gathered(kept);
  for (Triangle& t : mesh.triangles)
    for (std::int32_t& v : t) v = place[static_cast<std::size_t>(v)];
  return before - mesh.triangles.size();
}

}  // namespace meniscus::polygonize
