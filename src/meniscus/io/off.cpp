#include <meniscus/io/off.h>
#include <meniscus/io/text_scanner.h>
#include <meniscus/io/triangulate.h>

#include <algorithm>

namespace meniscus::io {
namespace {

/// Next line with something on it; '#' starts a comment.
void next_line_with_data(TextScanner& in) {
  while (in.skip_space() && in.next_is("#")) in.next_line();
  if (in.at_end()) in.fail("the file ends early");
}

struct VertexLayout {
  bool normals = false;
  bool colors = false;
};

VertexLayout read_magic(TextScanner& in) {
  next_line_with_data(in);
  const std::string_view magic = in.word();
  if (magic != "OFF" && magic != "COFF" && magic != "NOFF" && magic != "CNOFF")
    in.fail("not an OFF file: it does not start with OFF, COFF, NOFF or CNOFF");
  if (!in.at_line_end() && in.next_is("BINARY")) in.fail("binary OFF is not supported");
  return {magic.find('N') != magic.npos, magic.starts_with('C')};
}

/// Numbers with no decimal point anywhere, or any above 1: bytes.
void scale_colors(std::vector<double>& colors) {
  if (std::none_of(colors.begin(), colors.end(), [](double c) { return c > 1; })) return;
  for (double& c : colors) c /= 255;
}

void read_vertices(TextScanner& in, std::uint64_t count, VertexLayout layout, mesh::Mesh& m) {
  in.require(count, layout.normals ? 12 : 6, "vertices");
  std::vector<double> normals, colors;
  m.positions.reserve(count);
  for (std::uint64_t i = 0; i < count; ++i, in.next_line()) {
    next_line_with_data(in);
    const double x = in.number(), y = in.number();
    m.positions.emplace_back(x, y, in.number());
    for (int c = 0; layout.normals && c < 3; ++c) normals.push_back(in.number());
    for (int c = 0; layout.colors && c < 3; ++c) colors.push_back(in.number());
  }
  scale_colors(colors);
  if (layout.normals) m.attributes.set(attribute::kNormal, 3, std::move(normals));
  if (layout.colors) m.attributes.set(attribute::kColor, 3, std::move(colors));
}

void read_faces(TextScanner& in, std::uint64_t count, mesh::Mesh& m) {
  in.require(count, 2, "faces");
  std::vector<std::int64_t> corners;
  for (std::uint64_t i = 0; i < count; ++i, in.next_line()) {
    next_line_with_data(in);
    const std::uint64_t n = in.count();
    in.require(n, 2, "corners of a face");
    corners.resize(n);
    for (std::int64_t& c : corners) c = in.integer();
    add_polygon(corners, m.triangles);
  }
}

}  // namespace

RawGeometry read_off(const Source& source, ReadReport&) {
  TextScanner in(source.bytes, source.path);
  const VertexLayout layout = read_magic(in);
  next_line_with_data(in);  // the counts may stand on the first line
  const std::uint64_t vertices = in.count(), faces = in.count();
  in.next_line();  // a number of edges, which nobody needs
  RawGeometry out;
  read_vertices(in, vertices, layout, out.mesh);
  read_faces(in, faces, out.mesh);
  if (faces > 0 || vertices == 0) out.kind = Geometry::Kind::Mesh;
  return out;
}

}  // namespace meniscus::io
