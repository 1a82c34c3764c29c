#include <meniscus/base/parallel.h>
#include <meniscus/mesh/components.h>
#include <meniscus/polygonize/connect.h>
#include <meniscus/polygonize/finish.h>
#include <meniscus/polygonize/tidy_creases.h>

#include <algorithm>

namespace meniscus::polygonize {
namespace {

bool any_creases(const Shell& shell) { return std::any_of(shell.placed.begin(), shell.placed.end(), is_creased); }

Connection connect_tidily(const Shell& shell, std::size_t max_triangles, const RunControl& run) {
  Connection connection = connect(shell, max_triangles, run);
  tidy_creases(shell, connection.triangles);
  if (any_creases(shell) || !connection.degenerate.empty())
    connection.degenerate = without_area(shell, connection.triangles);
  return connection;
}

/// Vertices of different cells can meet only on or outside the cells' common boundary: brought back into their cells they
/// part, and if on the boundary, any move towards the middle parts them.
Connection connect_with_area(Shell& shell, std::size_t max_triangles, Settle settle, PolygonizeReport& report,
                             const RunControl& run) {
  Connection connection = connect_tidily(shell, max_triangles, run);
  if (connection.degenerate.empty()) return connection;
  settle(shell, connection.degenerate);
  connection = connect_tidily(shell, max_triangles, run);
  for (double fraction = 1e-4; !connection.degenerate.empty() && fraction < 1; fraction *= 8) {
    for (const std::size_t v : connection.degenerate) {
      Vec3& p = shell.positions[v];
      p += fraction * (place_of(shell, v).center - p);
    }
    report.vertices_moved = std::max(report.vertices_moved, connection.degenerate.size());
    connection = connect_tidily(shell, max_triangles, run);
  }
  return connection;
}

std::vector<double> flattened(const std::vector<Vec3>& vectors) {
  std::vector<double> values(3 * vectors.size());
  for (std::size_t i = 0; i < vectors.size(); ++i)
    for (std::size_t a = 0; a < 3; ++a) values[3 * i + a] = vectors[i][static_cast<Eigen::Index>(a)];
  return values;
}

/// Leaves out vertices that were merged into others.
void drop_unused(mesh::Mesh& mesh, std::vector<Vec3>& normals) {
  std::vector<std::int32_t> place(mesh.positions.size(), -1);
  for (const Triangle& t : mesh.triangles)
    for (const std::int32_t v : t) place[static_cast<std::size_t>(v)] = 0;
  std::int32_t count = 0;
  for (std::size_t v = 0; v < place.size(); ++v) {
    if (place[v] < 0) continue;
    mesh.positions[static_cast<std::size_t>(count)] = mesh.positions[v];
    if (!normals.empty()) normals[static_cast<std::size_t>(count)] = normals[v];
    place[v] = count++;
  }
  mesh.positions.resize(static_cast<std::size_t>(count));
  if (!normals.empty()) normals.resize(static_cast<std::size_t>(count));
  for (Triangle& t : mesh.triangles)
    for (std::int32_t& v : t) v = place[static_cast<std::size_t>(v)];
}

/// Vertices where the gradient says nothing get the mean normal of their triangles.
void fill_missing(std::vector<Vec3>& normals, const mesh::Mesh& mesh) {
  const auto missing = [](const Vec3& n) { return n.isZero(0); };
  if (std::none_of(normals.begin(), normals.end(), missing)) return;
  const std::vector<Vec3> means = mesh::vertex_normals(mesh);
  for (std::size_t v = 0; v < normals.size(); ++v)
    if (missing(normals[v])) normals[v] = means[v];
}

}  // namespace

mesh::Mesh finish(Shell shell, const FinishOptions& options, Settle settle, PolygonizeReport& report,
                  const RunControl& run) {
  report.nan_samples = shell.nan_samples;
  report.surface_cells = shell.cells.size();
  report.cells_sampled = shell.sampled_bricks * kBrickCells * kBrickCells * kBrickCells;
  if (shell.nan_samples > 0)
    report.warnings.push_back("the field is not a number at " + std::to_string(shell.nan_samples) +
                              " lattice points; they count as outside");

  mesh::Mesh mesh;
  mesh.triangles = connect_with_area(shell, options.max_triangles, settle, report, run).triangles;
  mesh.positions = std::move(shell.positions);
  if (!options.normals) shell.normals.clear();
  if (any_creases(shell)) drop_unused(mesh, shell.normals);
  if (!shell.normals.empty()) {
    fill_missing(shell.normals, mesh);
    mesh.attributes.set(attribute::kNormal, 3, flattened(shell.normals));
  }
  if (options.count_components) report.components = mesh::components(mesh).count;
  return mesh;
}

}  // namespace meniscus::polygonize
