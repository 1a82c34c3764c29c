#include <meniscus/base/error.h>
#include <meniscus/io/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace meniscus::io {
namespace {

/// False for NaN and infinity too.
bool sane(double x) { return std::abs(x) <= kLargestNumber; }
bool sane(const Vec3& p) { return sane(p.x()) && sane(p.y()) && sane(p.z()); }

void mark_bad_rows(const Attribute& a, std::vector<char>& bad) {
  if (a.is_integer()) return;
  const auto& values = std::get<0>(a.data);
  const bool physical = a.name == attribute::kVelocity || a.name == attribute::kRadius;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (physical ? !sane(values[i]) : !std::isfinite(values[i])) bad[i / a.components] = 1;
}

std::vector<std::size_t> good_rows(const std::vector<char>& bad) {
  std::vector<std::size_t> rows;
  rows.reserve(bad.size());
  for (std::size_t i = 0; i < bad.size(); ++i)
    if (!bad[i]) rows.push_back(i);
  return rows;
}

void check_sizes(const mesh::Mesh& m, const std::string& path) {
  for (const Attribute& a : m.attributes)
    if (a.size() != m.positions.size())
      throw IoError(path, "attribute '" + a.name + "' has " + std::to_string(a.size()) + " elements for " +
                              std::to_string(m.positions.size()) + " points");
}

void note_dropped(std::size_t count, const std::string& path, ReadReport& report) {
  if (count == 0) return;
  report.dropped += count;
  warn(report, "dropped-points",
       std::to_string(count) + " points with numbers that are not finite (or beyond 1e18) were left out", path);
}

points::Cloud finish_cloud(mesh::Mesh m, const std::string& path, ReadReport& report) {
  points::Cloud cloud{std::move(m.positions), std::move(m.attributes)};
  std::vector<char> bad(cloud.size(), 0);
  for (std::size_t i = 0; i < cloud.size(); ++i) bad[i] = !sane(cloud.positions[i]);
  for (const Attribute& a : cloud.attributes) mark_bad_rows(a, bad);
  const std::vector<std::size_t> rows = good_rows(bad);
  note_dropped(cloud.size() - rows.size(), path, report);
  return rows.size() == cloud.size() ? cloud : points::gathered(cloud, rows);
}

void drop_bad_attributes(mesh::Mesh& m, const std::string& path, ReadReport& report) {
  std::vector<std::string> names;
  for (const Attribute& a : m.attributes) {
    std::vector<char> bad(m.positions.size(), 0);
    mark_bad_rows(a, bad);
    if (std::find(bad.begin(), bad.end(), 1) != bad.end()) names.push_back(a.name);
  }
  for (const std::string& name : names) {
    m.attributes.erase(name);
    warn(report, "dropped-attribute", "attribute '" + name + "' has numbers that are not finite and was left out", path);
  }
}

void check_triangles(const mesh::Mesh& m, const std::string& path) {
  const auto count = static_cast<std::int64_t>(m.positions.size());
  for (std::size_t t = 0; t < m.triangles.size(); ++t)
    for (const std::int32_t v : m.triangles[t]) {
      if (v < 0 || v >= count)
        throw IoError(
            path, "triangle " + std::to_string(t) + " uses vertex " + std::to_string(v) + " of " + std::to_string(count));
      if (!sane(m.positions[static_cast<std::size_t>(v)]))
        throw IoError(path, "triangle " + std::to_string(t) + " uses vertex " + std::to_string(v) +
                                ", whose position is not finite (or beyond 1e18)");
    }
}

/// Leaves out vertices with bad positions, which no face uses (checked before).
void drop_bad_vertices(mesh::Mesh& m, const std::string& path, ReadReport& report) {
  std::vector<char> bad(m.positions.size());
  for (std::size_t i = 0; i < bad.size(); ++i) bad[i] = !sane(m.positions[i]);
  const std::vector<std::size_t> rows = good_rows(bad);
  if (rows.size() == m.positions.size()) return;
  note_dropped(m.positions.size() - rows.size(), path, report);
  std::vector<std::int32_t> renumbered(m.positions.size(), 0);
  std::vector<Vec3> kept;
  kept.reserve(rows.size());
  for (const std::size_t row : rows) {
    renumbered[row] = static_cast<std::int32_t>(kept.size());
    kept.push_back(m.positions[row]);
  }
  m.positions = std::move(kept);
  m.attributes = m.attributes.gathered(rows);
  for (Triangle& t : m.triangles)
    for (std::int32_t& v : t) v = renumbered[static_cast<std::size_t>(v)];
}

void drop_folded_triangles(mesh::Mesh& m, const std::string& path, ReadReport& report) {
  const std::size_t before = m.triangles.size();
  std::erase_if(m.triangles, [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
  if (before != m.triangles.size())
    warn(report, "dropped-triangles",
         std::to_string(before - m.triangles.size()) + " triangles that use a vertex twice were left out", path);
}

void check_finite(double x, double limit, const char* what, std::size_t row) {
  if (!(std::abs(x) <= limit))
    throw InvalidInput(std::string(what) + " of element " + std::to_string(row) +
                       " is not finite in the precision of the file; nothing was written");
}

}  // namespace

void warn(ReadReport& report, std::string code, std::string message, const std::string& where) {
  for (const Warning& w : report.warnings)
    if (w.code == code) return;
  report.warnings.push_back({std::move(code), std::move(message), where});
}

Geometry finish(RawGeometry raw, const std::string& path, ReadReport& report) {
  mesh::Mesh& m = raw.mesh;
  check_sizes(m, path);
  Geometry out;
  out.kind = raw.kind;
  if (raw.kind == Geometry::Kind::Cloud) {
    out.cloud = finish_cloud(std::move(m), path, report);
    return out;
  }
  if (m.positions.size() > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()))
    throw ResourceLimit(path + ": " + std::to_string(m.positions.size()) + " vertices; meshes hold up to 2147483647");
  check_triangles(m, path);
  drop_bad_vertices(m, path, report);
  drop_bad_attributes(m, path, report);
  drop_folded_triangles(m, path, report);
  out.mesh = std::move(m);
  return out;
}

void check_writable(const GeometryView& g) {
  const double limit = g.precision == Precision::Float32 ? static_cast<double>(std::numeric_limits<float>::max())
                                                         : std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < g.positions.size(); ++i)
    for (int c = 0; c < 3; ++c) check_finite(g.positions[i][c], limit, "the position", i);
  for (const Attribute& a : g.attributes) {
    if (a.size() != g.positions.size())
      throw InvalidInput("attribute '" + a.name + "' has " + std::to_string(a.size()) + " elements for " +
                         std::to_string(g.positions.size()) + " points");
    if (a.is_integer()) continue;
    const auto& values = std::get<0>(a.data);
    for (std::size_t i = 0; i < values.size(); ++i) check_finite(values[i], limit, a.name.c_str(), i / a.components);
  }
  for (const Triangle& t : g.triangles)
    for (const std::int32_t v : t)
      if (v < 0 || static_cast<std::size_t>(v) >= g.positions.size())
        throw InvalidInput("a triangle uses vertex " + std::to_string(v) + " of " + std::to_string(g.positions.size()));
}

}  // namespace meniscus::io
